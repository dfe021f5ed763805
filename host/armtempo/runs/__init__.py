"""Recorded runs: the folder of a run, reading it, and the curves made of it."""
