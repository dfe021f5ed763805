"""Features of the program beyond one motion at a time.

The program in the firmware has all of them. On stock MicroPython they are left out, to save heap
(``deploy/program_files.py`` on the host), and their commands are refused.
"""

SEQUENCES = True
OUTPUTS = True  # and inputs
JOG = True
SPEED = True  # another one than planned
BACKLASH = True  # of arms, crossed at each reversal

ALL = SEQUENCES and OUTPUTS and JOG and SPEED and BACKLASH
BITS = SEQUENCES << 0 | OUTPUTS << 1 | JOG << 2 | SPEED << 3
"""As ``messages.FEATURES`` names them."""
