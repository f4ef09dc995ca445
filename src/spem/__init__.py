"""Screened Poisson hyperfields for shape coding."""
