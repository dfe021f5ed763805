"""The virtual board underneath the board program: the chip, MicroPython's firmware, and the arm."""
