"""A board without a launcher, for tests of hardware code: import it before the code under test.

``start(edge_log=…)`` powers up a new board and returns it; time passes in simulated calls, or by
``board.spend(ticks)``. The options are those of ``ProcessOptions``; with ``flash`` the built-in ``open`` uses
that folder as ``/flash``.
"""

import builtins
import sys

if sys.implementation.name != "micropython":
    import additions  # noqa: F401

import machine_state
import setup
from chip import flash
from firmware import builtin_modules
from firmware.usb_serial import SilentPort

DEFAULTS = {
    "flash": ".",
    "flash_blocks": None,
    "instant_flash": False,
    "program": [],
    "speed": 0,
    "edge_log": None,
    "unique_id": "000102030405060708090a0b",
    "dma_preload": True,
    "power_cut_at": 0,
    "button_ms": 0,
    "sd_card": None,
    "damage": "",
    "machine": "STM32F4DISC with STM32F407",
    "turn_us": 1000,
    "arm": None,
    "faults": [],
    "seed": 0,
    "up": "",
}


def start(cause=1, line=None, **options):
    """Power up; ``line``: the serial port, by default without a host."""
    machine_state.serial = line or SilentPort()
    machine_state.edges = machine_state.flash = None
    setup.power_up(dict(DEFAULTS, **options), cause)
    builtins.open = machine_state.flash.open if "flash" in options else flash.real_open
    return machine_state.board


builtin_modules.replace()
