"""The server: the index over HTTP, and the explorer in the browser."""
