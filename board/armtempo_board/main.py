"""Becomes ``/flash/main.py``: starts the board program."""

import gc

import micropython

micropython.kbd_intr(-1)  # what a host sends may hold a Ctrl-C, which must not end the start
# the program takes most of the chip's heap, which falls to pieces where it is collected seldom
gc.threshold((gc.mem_free() + gc.mem_alloc()) // 64)

from armtempo_board import program  # noqa: E402

program.main()
