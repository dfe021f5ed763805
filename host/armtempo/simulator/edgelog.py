"""Reads a virtual board's edge log: every edge of every pin, with its time in timer ticks.

The file: ``b"ATE1"``, then records of 16 bytes, little endian, ``<BBBBIq``::

    kind  1 edges   pin (16 * port + number), level before, 0, count n, base tick; then n offsets (I):
                    the pin toggles at base + each offset
          2 counter timer number, 1 started or 0 stopped, 0, its counter, tick
          3 input   as kind 1, with n = 1: an input pin was driven from outside
          4 reset   the board was powered up or reset; ticks count from 0 again
          5 pulses  pin, 0, 0, ticks high, tick; then the period in ticks (I): PWM of a timer from that
                    tick on; 0 and 0: its end

Ticks are those of an 84 MHz clock, counted from the last reset.
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
    """PWM of a timer on a pin from a tick on; its end if ``high_ticks`` and ``period_ticks`` are 0."""

    tick: int
    high_ticks: int
    period_ticks: int


@dataclass
class PowerCycle:
    """The edges between two resets by pin (``"A15"``), and the starts of the motion clock."""

    pins: dict[str, Edges] = field(default_factory=dict)
    starts: list[int] = field(default_factory=list)
    """Tick of motion time 0 of each motion."""
    pulses: dict[str, list[Pulses]] = field(default_factory=dict)
    """PWM of timers by pin, in order of time."""
    ends: list[int] = field(default_factory=list)
    """Ticks at which the motion clock was stopped."""

    def motion(self, number: int = -1) -> dict[str, Edges]:
        """The edges of the ``number``-th motion by pin, in ticks of the motion clock.

        A motion lasts until the start of the next one. Raises RunFolderError if there is no such motion.
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
        """First tick of the motion whose time 0 this is: not before the clock's stop after the previous motion."""
        stopped = bisect.bisect_left(self.ends, zero)
        return max([zero - _LEAD_TICKS, *self.ends[max(stopped - 1, 0) : stopped]])


_LEAD_TICKS = 8_400_000


def read(path: Path) -> list[PowerCycle]:
    """All power cycles of a log, oldest first. Raises RunFolderError if the file is not a log."""
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
    """Collects the records of one power cycle."""

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
        elif count >= 1 << 31:  # a motion's clock is started shortly before it overflows to 0
            self._cycle.starts.append(tick + (1 << 32) - count)

    @property
    def cycle(self) -> PowerCycle:
        for pin, pieces in self._ticks.items():
            self._cycle.pins[_name(pin)] = (np.concatenate(pieces), np.concatenate(self._levels[pin]))
        return self._cycle


def _name(pin: int) -> str:
    return f"{_PORTS[pin >> 4]}{pin & 15}"
