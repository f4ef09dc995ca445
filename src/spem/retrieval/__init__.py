"""Ranked answers and their evaluation."""
