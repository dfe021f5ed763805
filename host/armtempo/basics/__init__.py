"""Errors, the array type, progress, the version."""
