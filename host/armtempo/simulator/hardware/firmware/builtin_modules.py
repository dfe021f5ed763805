"""Replaces built-in modules by the board's versions."""

import sys


def replace():
    """Later imports of ``os`` and so on get the board's; earlier ones keep the real modules."""
    import board_asyncio
    import board_micropython
    import board_os
    import board_time
    import board_uctypes

    sys.modules["asyncio"] = board_asyncio
    sys.modules["micropython"] = board_micropython
    sys.modules["os"] = board_os
    sys.modules["time"] = board_time
    sys.modules["uctypes"] = board_uctypes


def replace_sys():
    """The same for ``sys``, with the serial port as ``stdout``."""
    import board_sys

    sys.modules["sys"] = board_sys
