"""Recorded runs: the folder of a run, reading it, and the curves, tables and pages made of it and of plans."""
