"""What the explorer shows of one shape: fields, maps, parts, sources and words, as arrays."""
