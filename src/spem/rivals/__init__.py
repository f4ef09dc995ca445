"""Other descriptors of shapes, each from its own publication: what this system is measured against."""
