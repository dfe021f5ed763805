"""How a virtual board is started: what a caller may choose, and what its process is told about it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from armtempo_shared import armrecord

from armtempo.basics.arguments import checked_fields
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint
from armtempo.ports.names import VIRTUAL_ID
from armtempo.records import encode

DEFAULT_MACHINE = "STM32F4DISC with STM32F407"


@checked_fields
@dataclass(frozen=True)
class InjectedFault:
    """Something that goes wrong ``at_s`` seconds into the ``run``-th motion since power-up.

    ``kind``: ``stall`` (the main loop loses ``ms``), ``input`` (the pin ``name`` gets ``level`` 0 or 1),
    ``block`` (the joint ``joint``, counted from 0, cannot turn any more), ``slip`` (its encoder is turned by
    ``counts``), ``silence`` (the serial cable is out for ``ms``), ``hang`` (the program stops for ever) or
    ``crash`` (the next look at the time raises).

    From power-up on if ``run`` is 0: ``dead_pin`` (``name`` does not toggle), ``short`` (``name`` "A15-A1": the
    second pin toggles with the first), ``half_clock`` (TIM2 counts at half its rate), ``slow_flash`` (each operation
    takes ``ms`` more), ``late_interrupts`` (by ``ms``), ``dead_stream`` (DMA1's stream ``joint`` answers no request).
    """

    kind: str
    at_s: float
    run: int = 1
    ms: float = 0.0
    name: str = ""
    level: int = 0
    joint: int = 0
    counts: int = 0


@checked_fields
@dataclass(frozen=True)
class LaunchOptions:
    """What a virtual board may be started with; the defaults make one that is new and undamaged."""

    flash_dir: Path | str | None = None
    """The folder that is its flash and lasts; None: a new one that goes with the board."""
    virtual_time: bool = True
    """Motions run as fast as they can; else in real time."""
    edge_log: Path | str | None = None
    """File for every pin edge; read it with ``armtempo.simulator.edgelog``."""
    interpreter: Path | str | None = None
    """MicroPython or CPython; None: $ARMTEMPO_MICROPYTHON, ``micropython`` on PATH, or this Python."""
    arm: Arm | None = None
    """Gets motors with its ``model``; None: ideal motors for whatever arm the board is set up for."""
    start_deg: Sequence[float] | None = None
    """Where the arm is at power-up, degrees (J,); None: at home."""
    seed: int = 0
    """Tells one board from another, and gives its arm's scatter."""
    faults: Sequence[InjectedFault] = ()
    power_cut_at: int = 0
    """The power fails during this flash operation, counted from 1; 0: never."""
    deployed: bool = False
    """Run the program in the flash (``armtempo deploy`` puts it there) instead of the installed one."""
    flash_blocks: int | None = None
    """Size of the flash; None: the chip's."""
    button_s: float = 0.0
    """How long the user button is held from power-up on: safe mode from 0.6 to 1.2, a fresh file system from
    1.2 to 1.8."""
    sd_card: Path | str | None = None
    """Folder used as an SD card in the board."""
    damage: str = ""
    """Simulated damage of the flash: ``"no file system"``, ``"unreadable"``, or none."""
    machine: str = DEFAULT_MACHINE
    """What the firmware says it was built for."""


@dataclass(frozen=True, kw_only=True)
class ProcessOptions:
    """The options of ``main.py``, handed over as one JSON file. Paths are absolute."""

    flash: str
    """Folder that is the board's ``/flash``."""
    sources: list[str]
    """Folders with the packages of the board program: how its pins are wired, what an arm record says."""
    program: list[str]
    """Folders with the board's packages, as if they were deployed; empty: only what the flash has."""
    flash_blocks: int | None
    """Size of the flash; None: what an STM32F4DISC's file system has for files."""
    speed: float
    """Motions run at this multiple of real time; 0: as fast as they can."""
    edge_log: str | None
    unique_id: str
    """24 hex digits."""
    dma_preload: bool = True
    """DMA streams fetch one word ahead, as the chip's do in direct mode (RM0090 10.3.12)."""
    power_cut_at: int
    button_ms: float
    sd_card: str | None
    damage: str
    """A kind of damage of ``chip/flash.py``."""
    machine: str
    turn_us: int = 1000
    """What a turn of the program's main loop takes on the chip beyond its simulated calls."""
    arm: dict[str, Any] | None
    """Motors and encoders on the pins; None: ideal ones for the arm record in the flash."""
    up: str
    """File that is made when the program has started."""
    seed: int
    faults: list[InjectedFault]

    def write(self, path: Path) -> None:
        """Write them for ``main.py``."""
        path.write_text(json.dumps(asdict(self)))


def unique_id(seed: int) -> str:
    """A virtual board's 24 hex digits, another for each seed."""
    return (VIRTUAL_ID + hashlib.sha256(b"virtual board %d" % seed).hexdigest())[:24]


def describe(arm: Arm, start_deg: Sequence[float] | None = None) -> dict[str, Any]:
    """The arm record's fields and, per joint, where it is at power-up and its drive's model.

    ``start_deg`` (J,): None means the home posture. Raises InputError if a model makes no sense.
    """
    head, rows, _ = armrecord.unpack(encode.arm_record(arm))
    angles = start_deg if start_deg is not None else [joint.home_deg for joint in arm.driven]
    return {
        "head": head,
        "joints": [
            {**row, "start_deg": float(angle), **_joint(joint)}
            for row, angle, joint in zip(rows, angles, arm.driven, strict=True)
        ],
    }


def _joint(joint: DrivenJoint) -> dict[str, Any]:
    model, motor = joint.model, joint.motor
    if model.holding_torque_nm and not (model.inertia_kg_m2 or model.rotor_inertia_kg_m2):
        raise InputError(
            f"{joint.name}: model.holding_torque_nm without an inertia",
            "give model.inertia_kg_m2 or model.rotor_inertia_kg_m2 in the arm file",
        )
    return {
        "steps_per_deg": motor.steps_per_deg,
        "gear_ratio": motor.gear_ratio,
        "microsteps": motor.microsteps,
        "low_deg": joint.switches.low_deg,
        "high_deg": joint.switches.high_deg,
        "model": asdict(model),
    }
