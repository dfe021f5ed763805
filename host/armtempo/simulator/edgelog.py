"""Reads a virtual board's edge log: every change of every pin, with its time in timer ticks.

The file: ``b"ATE1"``, then records of 16 bytes, little endian, ``<BBBBIq``::

    kind  1 edges   pin (16 * port + number), level before, 0, count n, base tick; then n offsets (I):
                    the pin toggles at base + each offset
          2 counter timer number, 1 started or 0 stopped, 0, its counter, tick
          3 input   as kind 1, with n = 1: an input pin was changed from outside
          5 pulses pin, 0, 0, ticks high, tick; then the ticks of a period (I): a timer makes such pulses from
                    that tick on (its channel is in PWM mode); 0 and 0: it makes none
          4 reset   the board was powered up or reset; ticks count from 0 again

Ticks are of 84 MHz, since the last reset.
"""

from __future__ import annotations

import bisect
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.errors import RunFolderError

_RECORD = struct.Struct("<BBBBIq")
_EDGES, _COUNTER, _INPUT, _RESET, _PULSES = 1, 2, 3, 4, 5
_PORTS = "ABCDEFGHI"
_MOTION_TIMER = 2

Edges = tuple[NDArray[np.int64], NDArray[np.int8]]
"""Ticks of a pin's changes, ascending, and the level after each."""


class Pulses(NamedTuple):
    """What pulses a timer makes at a pin from a tick on; all 0 if it makes none."""

    tick: int
    high_ticks: int
    period_ticks: int


@dataclass
class PowerCycle:
    """What happened between two resets: per pin (``"A15"``) its edges, and the motion clock's starts."""

    pins: dict[str, Edges] = field(default_factory=dict)
    starts: list[int] = field(default_factory=list)
    """Tick of motion time 0 of each motion."""
    pulses: dict[str, list[Pulses]] = field(default_factory=dict)
    """Per pin what pulses a timer made there, in the order of time."""
    ends: list[int] = field(default_factory=list)
    """Tick at which the motion clock was stopped, if it was."""

    def motion(self, number: int = -1) -> dict[str, Edges]:
        """Per pin its edges in the ``number``-th motion, in ticks of the motion clock.

        A motion lasts until the next is started. Raises RunFolderError if there was none.
        """
        if not -len(self.starts) <= number < len(self.starts):
            raise RunFolderError(
                f"the edge log has {len(self.starts)} motions, not one number {number}",
                f"give a number from 0 to {len(self.starts) - 1}",
            )
        number %= len(self.starts)
        zero = self.starts[number]
        begin = self._before(zero)
        end = (
            self._before(self.starts[number + 1]) if number + 1 < len(self.starts) else np.iinfo(np.int64).max
        )
        cut = {}
        for pin, (ticks, levels) in self.pins.items():
            inside = (ticks >= begin) & (ticks < end)
            cut[pin] = (ticks[inside] - zero, levels[inside])
        return cut

    def _before(self, zero: int) -> int:
        """Tick from which on edges belong to the motion of this time 0: the clock was stopped after the one before."""
        stopped = bisect.bisect_left(self.ends, zero)
        return max([zero - _LEAD_TICKS, *self.ends[max(stopped - 1, 0) : stopped]])


_LEAD_TICKS = 8_400_000


def read(path: Path) -> list[PowerCycle]:
    """All power cycles of a log, oldest first. Raises RunFolderError if the file is none."""
    data = path.read_bytes()
    if data[:4] != b"ATE1":
        raise RunFolderError(
            f"{path} is not an edge log of a virtual board",
            "give a file that --edge-log of a virtual board wrote",
        )
    cycles: list[_Collector] = []
    at = 4
    while at + _RECORD.size <= len(data):
        kind, pin, before, _, count, base = _RECORD.unpack_from(data, at)
        at += _RECORD.size
        if kind == _RESET or not cycles:
            cycles.append(_Collector())
        if kind in (_EDGES, _INPUT):
            offsets = np.frombuffer(data, "<u4", count, at)
            at += 4 * count
            cycles[-1].edges(pin, before, base + offsets.astype(np.int64))
        elif kind == _PULSES:
            (period,) = struct.unpack_from("<I", data, at)
            at += 4
            cycles[-1].pulses(pin, Pulses(base, count, period))
        elif kind == _COUNTER and pin == _MOTION_TIMER:
            cycles[-1].counter(bool(before), count, base)
    return [collector.cycle for collector in cycles]


class _Collector:
    """Gathers the pieces of one power cycle."""

    def __init__(self) -> None:
        self._ticks: dict[int, list[NDArray[np.int64]]] = {}
        self._levels: dict[int, list[NDArray[np.int8]]] = {}
        self._cycle = PowerCycle()

    def edges(self, pin: int, before: int, ticks: NDArray[np.int64]) -> None:
        self._ticks.setdefault(pin, []).append(ticks)
        levels = (np.arange(1, len(ticks) + 1) + before) % 2
        self._levels.setdefault(pin, []).append(levels.astype(np.int8))

    def pulses(self, pin: int, pulses: Pulses) -> None:
        self._cycle.pulses.setdefault(_name(pin), []).append(pulses)

    def counter(self, started: bool, count: int, tick: int) -> None:
        if not started:
            self._cycle.ends.append(tick)
        elif count >= 1 << 31:  # a motion's clock is started a little before it comes round to 0
            self._cycle.starts.append(tick + (1 << 32) - count)

    @property
    def cycle(self) -> PowerCycle:
        for pin, pieces in self._ticks.items():
            self._cycle.pins[_name(pin)] = (np.concatenate(pieces), np.concatenate(self._levels[pin]))
        return self._cycle


def _name(pin: int) -> str:
    return f"{_PORTS[pin >> 4]}{pin & 15}"
