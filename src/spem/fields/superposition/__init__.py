"""Fields of single boundary sources, which sum to the field of all (2.3): at one ρ, and for all."""
