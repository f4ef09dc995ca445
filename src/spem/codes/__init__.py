"""Codes of shapes: node features, vocabulary, VLAD, models and collections."""
