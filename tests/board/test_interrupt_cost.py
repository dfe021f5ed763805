"""What the interrupts cost, counted on an emulated Cortex-M4; a change must not make it more."""

from __future__ import annotations

from array import array

import pytest

from tests import interpreters
from tests.benchmark.emulated import Machine

ACCESS = interpreters.ROOT / "board" / "armtempo_board" / "access.py"
# words of the block and of a joint in it, as access.py has them
_NEXT, _JOINTS, _HEAD, _JOINT = 0, 14, 19, 18
_TURNS_IN, _ON_TIM5, _CCR_AT, _CCMR_AT, _TURN_TIMES = 1, 4, 5, 6, 10
_CNT = 9

LIMITS = {1: (254, 487, 187), 3: (354, 687, 287), 6: (504, 987, 446)}
ARM_CHANNEL = 314


def _words(count: int) -> array[int]:
    return array("I", bytes(4 * count))


def _block(joints: int) -> array[int]:
    block = _words(_HEAD + 6 * _JOINT)
    block[_JOINTS] = joints
    block[_NEXT] = 5000
    for joint in range(joints):
        at = _HEAD + joint * _JOINT
        block[at + _CCR_AT] = 13 + joint % 3
        block[at + _CCMR_AT] = 6
        block[at + _ON_TIM5] = joint // 3
    return block


@pytest.fixture(scope="module")
def machine() -> Machine:
    return Machine(ACCESS)


def _cost(machine: Machine, name: str, *arguments: array[int] | int) -> int:
    before = machine.count
    machine.run(name, *arguments)
    return machine.count - before


@pytest.mark.parametrize("joints", sorted(LIMITS))
def test_interrupts(machine: Machine, joints: int) -> None:
    idle, turn, freeze = LIMITS[joints]
    block, timer2, timer5, port = _block(joints), _words(18), _words(18), _words(10)
    timer2[_CNT] = 100
    assert _cost(machine, "serve", block, timer2, port) <= idle
    block[_HEAD + _TURN_TIMES] = 100
    block[_HEAD + _TURNS_IN] = 1
    assert _cost(machine, "serve", block, timer2, port) <= turn
    assert _cost(machine, "freeze", block, timer2, timer5) <= freeze


def test_arming_a_channel(machine: Machine) -> None:
    ring = _words(1025)
    ring[0] = 5000
    assert _cost(machine, "arm_channel", _block(1), _words(18), ring, _HEAD) <= ARM_CHANNEL
