"""Shapes in: images, meshes, volumes, arrays and synthetic shapes to the value object `Shape`."""
