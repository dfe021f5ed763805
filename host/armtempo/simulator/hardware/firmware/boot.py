"""The firmware between reset and Python, after ports/stm32: boardctrl.c, main.c, factoryreset.c.

The user button, held at a reset, selects how to start. The file systems are mounted; a flash without one gets a
new one.
"""

import os
import sys

import machine_state
from chip import flash
from chip.processor import TICKS_PER_MS

from firmware import external_interrupts
from firmware.pin_api import Pin

NORMAL, SAFE, FACTORY = 1, 2, 3
BOOT_ERROR, MAIN_ERROR = 4, 3
"""Number of times that red and green flash alternately after an exception in boot.py, in main.py."""
_BUTTON = "PA0"
_RED, _GREEN, _ORANGE, _BLUE = "PD14", "PD12", "PD13", "PD15"
_LOOKS = 30  # times that the button is read while a mode is shown
_LOOK_MS = 20
_FACTORY_FILES = {"boot.py": 454, "main.py": 34, "README.txt": 526, "pybcdc.inf": 2597}
"""Bytes of the files of a new file system, by MicroPython 1.29 for an STM32F4DISC: they take 10 blocks."""
_COMMENT = "# a file of a fresh file system\n"


def choose_mode(board, held_ms):
    """The mode to start in, for a button held for ``held_ms`` from the reset on; the LEDs show the modes."""
    if not held_ms:
        return NORMAL
    external_interrupts.set_level(_BUTTON, 1)
    release = board.now + int(held_ms * TICKS_PER_MS)
    mode = NORMAL
    while _held(board, mode, release):
        mode = mode % FACTORY + 1
    for _ in range(6):
        _show(board, 0, 50)
        _show(board, mode, 50)
    board.stall(400 * TICKS_PER_MS)
    _show(board, 0, 0)
    return mode


def _held(board, mode, release):
    """Show a mode; returns whether the button is still held at the end."""
    _show(board, mode, 0)
    for _ in range(_LOOKS):
        board.stall(_LOOK_MS * TICKS_PER_MS)
        if board.now >= release:
            external_interrupts.set_level(_BUTTON, None)
            return False
    return True


def _show(board, mode, ms):
    """Show a mode: green, orange and blue are its bits."""
    for bit, name in enumerate((_GREEN, _ORANGE, _BLUE)):
        Pin(name, Pin.OUT_PP).value(mode >> bit & 1)
    board.stall(ms * TICKS_PER_MS)


def flash_error(times):
    """Flash red and green alternately."""
    for _ in range(times):
        for red in (1, 0):
            Pin(_RED, Pin.OUT_PP).value(red)
            Pin(_GREEN, Pin.OUT_PP).value(1 - red)
            machine_state.board.stall(250 * TICKS_PER_MS)
    Pin(_GREEN, Pin.OUT_PP).value(0)


def mount(mode, path):
    """Mount flash and SD card; ``path``: the folders before and after theirs on ``sys.path``."""
    if mode == FACTORY or machine_state.flash.damage == flash.NO_FILE_SYSTEM or _is_new():
        _make_file_system()
    machine_state.flash.mounts = {"/flash": machine_state.flash.root}
    machine_state.flash.cwd = "/flash"
    card = machine_state.options["sd_card"]
    if card and not flash.exists(machine_state.flash.root + "/SKIPSD"):
        machine_state.flash.mounts["/sd"] = card
        machine_state.flash.cwd = "/sd"
    before, behind = path
    sys.path[:] = before + _library_folders() + behind


def _is_new():
    """Whether the flash is empty."""
    return not machine_state.flash.damage and not os.listdir(machine_state.flash.root)


def _make_file_system():
    """Write the files of a new file system, except start files if the program has its own elsewhere."""
    machine_state.flash.format()
    for name, size in _FACTORY_FILES.items():
        if name.endswith(".py") and machine_state.options["program"]:
            continue
        with flash.real_open(machine_state.flash.root + "/" + name, "w") as file:
            file.write((_COMMENT + "#" * size)[:size])


def _library_folders():
    """The folders in which the interpreter searches modules, the card's first."""
    folders = []
    for point in ("/sd", "/flash"):
        root = machine_state.flash.mounts.get(point)
        if root and not (point == "/flash" and machine_state.flash.damage):
            folders += [root, root + "/lib"]
    return folders
