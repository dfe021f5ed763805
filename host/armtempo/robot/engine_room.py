"""Does the engine for an arm fit into the board's memory? By the board's own formula, before anything is sent."""

from __future__ import annotations

from dataclasses import dataclass

from armtempo_shared import engine_memory, limits

from armtempo.basics.errors import InputError
from armtempo.link.board_messages import Hello
from armtempo.model.arm import Arm
from armtempo.records import encode


@dataclass(frozen=True)
class Room:
    """Memory for engines: ``size`` bytes of heap, and heap for the objects of that many ``joints``.

    Beside it the board has memory for step generators, the same on every chip (``engine_memory.PROCESSOR_WORDS``).
    """

    size: int
    joints: int

    @classmethod
    def of_board(cls, info: Hello) -> Room:
        """What a board states."""
        return cls(info.engine_room, info.engine_joints)

    def holds(self, rates: list[int], beside: int = 0) -> bool:
        """Whether an engine for joints of these highest step rates (steps/s) fits, and ``beside`` bytes."""
        return len(rates) <= self.joints and engine_memory.fits(rates, self.size // 4, beside)

    def holds_arm(self, arm: Arm) -> bool:
        """Whether the engine for an arm fits, with its outputs and inputs."""
        return self.holds(encode.step_rates(arm), _beside(arm))

    def words(self) -> str:
        """What fits: bytes, joints, steps/s."""
        return f"{self.size} bytes: {', '.join(self._fitting()) or 'no arm fits'}"

    def _fitting(self) -> list[str]:
        found = [(joints, self._highest_rate(joints)) for joints in range(1, self.joints + 1)]
        return [f"{joints} x {rate} steps/s" for joints, rate in found if rate]

    def _highest_rate(self, joints: int) -> int:
        """The highest step rate, in whole 1000 steps/s, at which that many joints fit; 0 where none do."""
        for rate in range(limits.MAX_STEP_RATE_SUM // joints // 1000, 0, -1):
            if self.holds([1000 * rate] * joints):
                return 1000 * rate
        return 0


AS_FILES = Room(4_648, 3)
IN_FIRMWARE = Room(4 * engine_memory.LARGEST_WORDS, limits.MAX_JOINTS)
"""The program as compiled files on MicroPython's own firmware for the STM32F4DISC, and built into it.

Measured: ``python -m tests.benchmark.room MICROPYTHON``.
"""
_BUILD = "see 'armtempo firmware --help'"


def check(arm: Arm, info: Hello) -> None:
    """InputError with the bytes needed, the bytes there and what to do, where the engine for the arm does not fit."""
    rates, room = encode.step_rates(arm), Room.of_board(info)
    if room.holds_arm(arm):
        return
    if len(rates) > room.joints:
        raise InputError(
            f"arm {arm.name!r} drives {len(rates)} joints; the board has memory for {room.joints}",
            f"drive fewer joints{_or_firmware(arm, room)}",
        )
    raise InputError(
        f"arm {arm.name!r} needs {4 * engine_memory.words(rates)} bytes for its engine{_and_beside(arm)}; the board "
        f"has {room.size}",
        f"lower its top speeds (its joints step up to {', '.join(map(str, rates))} steps/s; slower ones have "
        f"smaller rings), drive fewer joints{_or_firmware(arm, room)}",
    )


def of_arm(arm: Arm, info: Hello | None = None) -> str:
    """In a line: the memory that an arm needs, and whether a board has it; without one, where it fits."""
    rates = encode.step_rates(arm)
    needs = f"memory on the board: {4 * engine_memory.words(rates)} bytes for {len(rates)} joints{_and_beside(arm)}"
    if info is not None:
        room = Room.of_board(info)
        return (
            f"{needs} of {room.size}"
            if room.holds_arm(arm)
            else f"{needs}, too much{_or_firmware(arm, room)}"
        )
    if AS_FILES.holds_arm(arm):
        return f"{needs}: fits with the program as files or in the firmware"
    if IN_FIRMWARE.holds_arm(arm):
        return f"{needs}: fits only with the program in the firmware ({_BUILD})"
    return f"{needs}: too much for an STM32F407"


def of_board(info: Hello) -> list[str]:
    """What fits on a board, and what more would with the program in its firmware."""
    room = Room.of_board(info)
    lines = [f"memory for an arm: {room.words()}"]
    if room.size < IN_FIRMWARE.size:
        lines.append(
            f"with the program in the firmware ({_BUILD}): {IN_FIRMWARE.words()}, and room for sequences"
        )
    return lines


def _or_firmware(arm: Arm, room: Room) -> str:
    """The firmware as a way out, where it is one."""
    if room.size >= IN_FIRMWARE.size or not IN_FIRMWARE.holds_arm(arm):
        return ""
    return f", or put the program into the board's firmware, where this arm fits ({_BUILD})"


def _beside(arm: Arm) -> int:
    """Bytes for the arm's outputs and inputs."""
    return engine_memory.output_bytes(len(arm.outputs), len(arm.inputs))


def _and_beside(arm: Arm) -> str:
    return f", and {_beside(arm)} for its outputs and inputs" if _beside(arm) else ""
