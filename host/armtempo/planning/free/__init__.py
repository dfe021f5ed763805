"""Paths that may bend between the via points: path and time axis found together."""
