"""Becomes ``/flash/main.py``: starts the board program."""

import micropython

micropython.kbd_intr(-1)  # what a host sends may hold a Ctrl-C, which must not end the start

from armtempo_board import start  # noqa: E402

start()
