"""Where the boundary condition sits: points, their order along contours, patches, sources made of them."""
