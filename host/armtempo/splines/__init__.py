"""B-splines, Bernstein form, the time axis, trajectories, and rigorous bounds of their extremes."""
