"""Puts the board's own versions of built-in modules in their place."""

import sys


def replace():
    """From here on ``import os`` and its like get the board's; earlier imports keep the real ones."""
    import board_micropython
    import board_os
    import board_time
    import board_uctypes

    sys.modules["micropython"] = board_micropython
    sys.modules["os"] = board_os
    sys.modules["time"] = board_time
    sys.modules["uctypes"] = board_uctypes


def replace_sys():
    """The same for ``sys``, whose ``stdout`` is then the serial port."""
    import board_sys

    sys.modules["sys"] = board_sys
