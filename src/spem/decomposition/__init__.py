"""Parts: interaction vectors of boundary sources, their readings, and their non-negative decomposition."""
