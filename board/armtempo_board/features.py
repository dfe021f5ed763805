"""What the program can do beyond one motion at a time.

All of it in the firmware. In files on MicroPython's own firmware there is no heap for more, so they are made without
(``deploy/program_files.py`` on the host), and a command that needs more is refused.
"""

SEQUENCES = True
OUTPUTS = True  # and inputs
JOG = True
SPEED = True  # another one than planned

ALL = SEQUENCES and OUTPUTS and JOG and SPEED
BITS = SEQUENCES << 0 | OUTPUTS << 1 | JOG << 2 | SPEED << 3
"""As ``messages.FEATURES`` names them."""
