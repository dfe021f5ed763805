"""Whether the engine for an arm fits into the board's memory, by the board's formula, before anything is sent."""

from __future__ import annotations

from dataclasses import dataclass

from armtempo_shared import armrecord, engine_memory, limits

from armtempo.basics.errors import InputError
from armtempo.encoding import encode
from armtempo.model.arm import Arm


@dataclass(frozen=True)
class EngineHeap:
    """Heap for an engine and its objects: ``size`` bytes.

    Step generators have more memory outside the heap, the same on every chip (``engine_memory.PROCESSOR_WORDS``).
    """

    size: int

    def holds(self, rates: list[int], with_backlash: int = 0) -> bool:
        """Whether an engine for joints of these highest step rates (steps/s) fits, some ``with_backlash``."""
        return engine_memory.fits(rates, self.size, with_backlash)

    def holds_arm(self, arm: Arm) -> bool:
        """Whether the engine for an arm fits, and the program has what it needs."""
        return not self.lacks_backlash(arm) and self.holds(encode.step_rates(arm), _with_backlash(arm))

    def lacks_backlash(self, arm: Arm) -> bool:
        """Whether the arm has backlash and the program cannot cross it: only that in the firmware, which has all the
        memory, does."""
        return _with_backlash(arm) > 0 and self.size < IN_FIRMWARE.size

    def describe(self) -> str:
        """Describe what fits: bytes, joints, steps/s."""
        return f"{self.size} bytes: {', '.join(self._fitting()) or 'no arm fits'}"

    def _fitting(self) -> list[str]:
        found = [(joints, self._highest_rate(joints)) for joints in range(1, limits.MAX_JOINTS + 1)]
        return [f"{joints} x {rate} steps/s" for joints, rate in found if rate]

    def _highest_rate(self, joints: int) -> int:
        """The highest step rate, in whole 1000 steps/s, at which ``joints`` joints fit; 0 if none."""
        for rate in range(limits.MAX_STEP_RATE_SUM // joints // 1000, 0, -1):
            if self.holds([encode.with_margin(1000 * rate)] * joints):
                return 1000 * rate
        return 0


CORE = EngineHeap(10_900)
IN_FIRMWARE = EngineHeap(engine_memory.LARGEST_BYTES)
"""Memory with the program's core on stock MicroPython for the STM32F4DISC, and built into the firmware.

Measured: ``python -m tests.benchmark.arm_heap MICROPYTHON``.
"""
_BUILD = "'armtempo flash'"


def check(arm: Arm, heap: EngineHeap) -> None:
    """Raise InputError if the engine for the arm does not fit, with the bytes needed and available."""
    if heap.holds_arm(arm):
        return
    if heap.lacks_backlash(arm):
        raise InputError(
            f"arm {arm.name!r} has backlash_deg, which the program's core on stock MicroPython does not cross",
            f"put the program into the board's firmware ({_BUILD}), or leave backlash_deg out",
        )
    rates = encode.step_rates(arm)
    raise InputError(
        f"arm {arm.name!r} needs {_needed_bytes(arm)} bytes for its engine; the board has {heap.size}",
        f"lower its top speeds (its joints step up to {', '.join(map(str, rates))} steps/s; slower ones have "
        f"smaller rings), drive fewer joints{_or_firmware(arm)}",
    )


def of_arm(arm: Arm, heap: EngineHeap | None = None) -> str:
    """One line: the memory that an arm needs, and whether the board has it (without ``heap``: which boards
    have it)."""
    needs = f"memory on the board: {_needed_bytes(arm)} bytes for {len(arm.motors)} joints"
    if heap is not None and heap.lacks_backlash(arm):
        return f"{needs}; its backlash needs the program in the firmware ({_BUILD})"
    if heap is not None:
        return f"{needs} of {heap.size}" if heap.holds_arm(arm) else f"{needs}, too much{_or_firmware(arm)}"
    if CORE.holds_arm(arm):
        return f"{needs}: fits with stock MicroPython or with the program in it"
    if IN_FIRMWARE.holds_arm(arm):
        return f"{needs}: fits only with the program in the firmware ({_BUILD})"
    return f"{needs}: too much for an STM32F407"


def _needed_bytes(arm: Arm) -> int:
    return engine_memory.needed_bytes(encode.step_rates(arm), _with_backlash(arm))


def _with_backlash(arm: Arm) -> int:
    """How many joints have backlash."""
    return armrecord.backlash_count(encode.backlash(arm))


def of_board(heap: EngineHeap) -> list[str]:
    """Lines: what fits on a board, and what would fit with the program in its firmware."""
    lines = [f"memory for an arm: {heap.describe()}"]
    if heap.size < IN_FIRMWARE.size:
        lines.append(
            f"with the program in the firmware ({_BUILD}): {IN_FIRMWARE.describe()}, and memory for sequences"
        )
    return lines


def _or_firmware(arm: Arm) -> str:
    """The advice to flash the firmware, if the arm fits there."""
    if not IN_FIRMWARE.holds_arm(arm):
        return ""
    return f", or put the program into the board's firmware, where this arm fits ({_BUILD})"
