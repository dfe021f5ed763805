"""Power cycles: ``boot.py``, ``main.py``, the prompt, resets."""

import builtins
import sys

import machine_state
import setup
from chip import memory, timers
from firmware import boot
from firmware.repl import Repl, SoftReset, board_print
from machine_state import PowerOff, Reset

_POWER_ON, _SOFT = 1, 0


def run(options, hardware):
    """Run the board until the launcher ends; ``hardware``: folders of the built-in modules."""
    setup.learn(options["sources"])
    path = hardware, options["program"] + sys.path
    before = list(sys.modules)
    builtins.print = board_print
    cause = _POWER_ON
    while True:
        mode = setup.power_up(options, cause)
        builtins.open = machine_state.flash.open
        try:
            _live(options, before, mode, path)
        except Reset as reset:
            cause = reset.cause
            _forget(before)
        except PowerOff:
            break
    if machine_state.edges:
        machine_state.edges.flush()


def _live(options, before, mode, path):
    """Run the program, then the prompt; again after each soft reset, which ends the safe mode."""
    raw = False
    while True:
        boot.mount(mode, path)
        if machine_state.arm is None or machine_state.arm.board is not machine_state.board:
            setup.connect(machine_state.pins)
        repl = Repl(raw)
        try:
            if mode != boot.SAFE:
                _start(options, repl)
        except SoftReset:
            pass
        repl.run()
        raw = repl.raw
        mode = boot.NORMAL
        _soft_reset()
        _forget(before)


def _start(options, repl):
    """Run boot.py and, if it raises nothing, main.py, unless the host uses the raw REPL."""
    if not _execute(options, repl, "boot.py"):
        boot.flash_error(boot.BOOT_ERROR)
    elif not repl.raw and not _execute(options, repl, "main.py"):
        boot.flash_error(boot.MAIN_ERROR)


def _execute(options, repl, name):
    """Run a file of the flash or card, or of a program that is not deployed; False if it raises."""
    folders = [machine_state.flash.cwd] + [folder + "/armtempo_board" for folder in options["program"]]
    for folder in folders:
        try:
            with machine_state.flash.open(folder + "/" + name) as file:
                text = file.read()
        except OSError:
            continue
        return repl.execute(text, name, log=True)
    return True


def _soft_reset():
    """As the firmware between two runs: stop its timers, remove callbacks; registers stay."""
    board = machine_state.board
    for number in board.api:
        at = board.timers[number].at
        memory.words[at + timers.CR1] = memory.words[at + timers.CCER] = memory.words[at + timers.DIER] = 0
    for known in (board.api, board.callbacks, board.extints):
        known.clear()
    board.scheduled = []
    board.pending = []
    board.masked = False
    board.sync()
    machine_state.serial.attached = True
    machine_state.serial.rts = machine_state.serial.cts = False
    machine_state.settings["reset_cause"] = _SOFT


def _forget(before):
    """Unload the program's modules."""
    for name in list(sys.modules):
        if name not in before:
            del sys.modules[name]
    caches = getattr(sys, "path_importer_cache", None)
    if caches:  # CPython caches the folders
        caches.clear()
