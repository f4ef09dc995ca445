"""CUDA sources of codes."""
