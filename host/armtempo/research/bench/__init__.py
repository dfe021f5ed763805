"""Comparison of the searches."""
