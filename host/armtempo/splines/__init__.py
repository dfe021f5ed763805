"""Splines: B-spline and Bernstein form, the time axis, trajectories, proven bounds of their extremes."""
