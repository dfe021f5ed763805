"""From power-up to power-up: ``boot.py``, ``main.py``, the prompt, resets."""

import builtins
import sys

from simulator import firmware, memory, setup, the, timer_registers
from simulator.repl import Repl, SoftReset, board_print
from simulator.reset import PowerOff, Reset

_POWER_ON, _SOFT = 1, 0


def run(options, hardware):
    """Run the board until the launcher goes; ``hardware``: the folders of its built-in modules."""
    setup.learn(options["sources"])
    path = hardware, options["program"] + sys.path
    before = list(sys.modules)
    builtins.print = board_print
    cause = _POWER_ON
    while True:
        mode = setup.power_up(options, cause)
        builtins.open = the.flash.open
        try:
            _live(options, before, mode, path)
        except Reset as reset:
            cause = reset.cause
            _forget(before)
        except PowerOff:
            break
    if the.edges:
        the.edges.flush()


def _live(options, before, mode, path):
    """Run the program, then the prompt, again after each soft reset, which ends the safe mode."""
    raw = False
    while True:
        firmware.mount(mode, path)
        if the.arm is None or the.arm.board is not the.board:
            setup.connect(the.pins)
        repl = Repl(raw)
        try:
            if mode != firmware.SAFE:
                _start(options, repl)
        except SoftReset:
            pass
        repl.run()
        raw = repl.raw
        mode = firmware.NORMAL
        _soft_reset()
        _forget(before)


def _start(options, repl):
    """boot.py, and where that went well main.py, unless the host talks to the raw REPL."""
    if not _execute(options, repl, "boot.py"):
        firmware.flash_error(firmware.BOOT_ERROR)
    elif not repl.raw and not _execute(options, repl, "main.py"):
        firmware.flash_error(firmware.MAIN_ERROR)


def _execute(options, repl, name):
    """Run a file of flash or card, or of the program that is not deployed; False where it raises."""
    folders = [the.flash.cwd] + [folder + "/armtempo_board" for folder in options["program"]]
    for folder in folders:
        try:
            with the.flash.open(folder + "/" + name) as file:
                text = file.read()
        except OSError:
            continue
        return repl.execute(text, name, log=True)
    return True


def _soft_reset():
    """What the firmware does between two runs: timers it made stop, callbacks go; registers stay."""
    board = the.board
    for number in board.api:
        at = board.timers[number].at
        memory.words[at + timer_registers.CR1] = memory.words[at + timer_registers.CCER] = memory.words[
            at + timer_registers.DIER
        ] = 0
    for known in (board.api, board.callbacks, board.extints):
        known.clear()
    board.scheduled = []
    board.pending = []
    board.masked = False
    board.sync()
    the.serial.attached = True
    the.serial.rts = the.serial.cts = False
    the.settings["reset_cause"] = _SOFT


def _forget(before):
    """The program's modules are loaded afresh the next time."""
    for name in list(sys.modules):
        if name not in before:
            del sys.modules[name]
    caches = getattr(sys, "path_importer_cache", None)
    if caches:  # CPython remembers which folders there were
        caches.clear()
