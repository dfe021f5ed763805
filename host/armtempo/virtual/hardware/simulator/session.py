"""From power-up to power-up: ``boot.py``, ``main.py``, the REPL, resets."""

import builtins
import sys

from simulator import setup, the
from simulator.board import print_exception
from simulator.reset import PowerOff, Reset

_POWER_ON = 1


def run(options):
    """Run the board until the launcher goes."""
    before = list(sys.modules)
    cause = _POWER_ON
    while True:
        setup.power_up(options, cause)
        builtins.open = the.flash.open
        try:
            _program(options)
        except Reset as reset:
            cause = reset.cause
        except PowerOff:
            break
        for name in list(sys.modules):
            if name not in before:
                del sys.modules[name]
    if the.edges:
        the.edges.flush()


def _program(options):
    try:
        from armtempo_board import pins

        setup.connect(pins)
    except ImportError:  # nothing deployed yet
        pass
    for name in ("boot.py", "main.py"):
        try:
            _execute(options, name)
        except Exception as error:
            print_exception(error)
    while True:
        the.pace.idle()


def _execute(options, name):
    """Run a file of the flash, or of the program that is not deployed."""
    folders = [options["flash"]] + [folder + "/armtempo_board" for folder in options["program"]]
    for folder in folders:
        try:
            with the.flash.open(folder + "/" + name) as file:
                text = file.read()
        except OSError:
            continue
        exec(compile(text, name, "exec"), {"__name__": "__main__"})
        return
