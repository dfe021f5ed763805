"""Arm and motion as the board takes them, and back."""
