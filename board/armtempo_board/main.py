"""Becomes ``/flash/main.py``: starts the board program."""

import gc

import micropython

micropython.kbd_intr(-1)  # what a host sends may hold a Ctrl-C, which must not end the start
gc.threshold(1024)  # the program takes most of the heap, which falls to pieces where it is collected seldom

from armtempo_board import program  # noqa: E402

program.main()
