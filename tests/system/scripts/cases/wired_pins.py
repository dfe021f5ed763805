"""The board's outputs and inputs on the simulated chip: levels, pulses, safe values, and what a whole program does.

Argument: a scratch folder.
"""

import sys

import bare_board
import cases
import machine_state  # replaces time, os, uctypes, micropython; so before everything else
from chip.flash import real_open
from firmware.external_interrupts import set_level

# isort: split
import struct

from armtempo_board.stepgen import step_generator  # isort: skip  # noqa: F401  as program.py: the deepest first
from armtempo_board.app import arm_setup, output_setup
from armtempo_board.app.output_setup import inputs_of, outputs_of
from pin_rows import GRIPPER, PART, PUMP

SCRATCH = sys.argv[1]
MS = 84_000
HAND = dict(GRIPPER, pin=0x1F, timer=12, channel=2, prescaler=25, period=64614)
ARM = dict(HAND, pin=0x1E, channel=1, low=8077, high=1615)
FAN = dict(PUMP, pin=0x48, timer=0)
TONE = dict(PUMP, pin=0x49, timer=1, channel=1, prescaler=0, period=8399, low=0, high=8400, safe=32768)
DOOR = {"pin": 0x33, "active_high": 1, "debounce_ms": 0}


def line(name):
    return machine_state.board.pins.line(name)


def pulses(name):
    """(ticks high, ticks of the period) at a pin, of 84 MHz."""
    return line(name).pulses


def case_a_switch_is_a_level():
    outputs = outputs_of([PUMP, FAN])
    assert (line("D0").mode(), line("D0").level) == (1, 1)
    outputs.set(0, 65535)
    assert line("D0").level == 0
    outputs.set(1, 0)
    assert (line("D0").level, line("E8").level, list(outputs.values)) == (0, 1, [65535, 0])
    outputs.safe()
    assert (line("D0").level, list(outputs.values)) == (1, [0, 0])


def case_servos_have_the_pulses_of_the_record():
    outputs = outputs_of([GRIPPER, HAND, ARM, TONE])
    period = 64615 * 26  # both clocks: 52 at 168 MHz, 26 at 84 MHz
    assert pulses("B8")[1] == pulses("B15")[1] == pulses("B14")[1] == period
    for value, high in ((0, 1615), (65535, 8077), (32768, 4846)):
        for number in (0, 1):
            outputs.set(number, value)
        outputs.set(2, 65535 - value)
        for pin in ("B8", "B15", "B14"):
            assert abs(pulses(pin)[0] - high * 26) <= 26, (pin, value)
    assert pulses("E9") == (2100, 4200)
    outputs.set(3, 65535)
    assert pulses("E9") == (4200, 4200)
    outputs.set(3, 0)
    assert pulses("E9") == (0, 4200)


def case_safe_values():
    outputs = outputs_of([PUMP, GRIPPER])
    safe = pulses("B8")
    assert abs(safe[0] / 84 - 722) < 1  # us: 500 + 2000 * 20 / 180
    outputs.set(0, 65535)
    outputs.set(1, 65535)
    assert pulses("B8") != safe
    outputs.safe()
    outputs.safe()
    assert (pulses("B8"), line("D0").level) == (safe, 1)


class Board:
    """In the place of the controller."""

    def __init__(self):
        self.extra_commands = {}


def case_what_is_closed_can_be_made_anew():
    board = Board()
    output_setup.attach(board, [GRIPPER, HAND], [])
    arm_setup.drop_outputs(board)
    assert (board.outputs, board.inputs, board.extra_commands) == (None, None, {})
    assert pulses("B8") == pulses("B15") == (0, 0)
    assert line("B8").mode() == 0
    outputs_of([dict(GRIPPER, prescaler=51, period=32307)])
    assert pulses("B8")[1] == 32308 * 26


def case_inputs_have_their_pull_and_debounce():
    inputs = inputs_of([PART, DOOR])
    assert (inputs.level(0), inputs.level(1), inputs.levels) == (0, 0, 0)
    set_level("D1", 0)
    set_level("D3", 1)
    for now_ms in range(20):
        inputs.poll(now_ms)
        assert inputs.level(1) == 1
        assert inputs.level(0) == (now_ms >= 10), now_ms
    assert inputs_of([PART, DOOR]).levels == 3


def case_the_edge_log_tells_of_pulses():
    path = SCRATCH + "/log"
    bare_board.start(edge_log=path)
    outputs = outputs_of([GRIPPER])
    machine_state.board.spend(50 * MS)
    outputs.set(0, 65535)
    machine_state.edges.flush()
    with real_open(path, "rb") as file:
        data = file.read()
    found = []
    at = 4
    while at < len(data):
        kind, pin, _, _, count, tick = struct.unpack_from("<BBBBIq", data, at)
        at += 16
        if kind == 5:
            assert pin == 0x18
            found.append((tick, count))
            at += 4
        elif kind in (1, 3):
            at += 4 * count
    assert [high for _, high in found] == [2333 * 26, 8077 * 26]
    assert found[1][0] - found[0][0] >= 50 * MS


for name in cases.wanted(globals()):
    bare_board.start()
    globals()[name]()
    print(name)
