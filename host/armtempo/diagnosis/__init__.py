"""Checks of an arm file and a job, of this machine, and of the board, with advice."""
