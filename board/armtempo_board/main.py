"""Becomes ``/flash/main.py``: starts the board program."""

import micropython

micropython.kbd_intr(-1)  # a Ctrl-C in what a host sends must not end the start

from armtempo_board import start  # noqa: E402

start()
