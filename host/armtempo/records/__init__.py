"""Arm record and motion record: arm and motion in the units of the board, and back."""
