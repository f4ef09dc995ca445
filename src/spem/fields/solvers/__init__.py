"""Solvers of the screened Poisson system, one idea a file."""
