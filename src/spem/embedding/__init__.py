"""SPEM maps: principal components of the hyperfield over ρ."""
