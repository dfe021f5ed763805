"""Becomes ``/flash/main.py``: starts the board program."""

from armtempo_board import program

program.main()
