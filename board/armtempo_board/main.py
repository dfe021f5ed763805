"""Becomes ``/flash/main.py``: starts the board program."""

import micropython

micropython.kbd_intr(-1)  # what a host sends may hold a Ctrl-C, which must not end the start

from armtempo_board import collect_often  # noqa: E402

collect_often()  # the program takes most of the chip's heap

from armtempo_board import program  # noqa: E402

program.main()
