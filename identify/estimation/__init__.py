"""Least squares on triangular factors, and its statistics."""
