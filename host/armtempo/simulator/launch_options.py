"""Options of a virtual board: those of ``launch``, and those for its process."""

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
from armtempo.encoding import encode
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint
from armtempo.ports.names import VIRTUAL_ID

DEFAULT_MACHINE = "STM32F4DISC with STM32F407"


@checked_fields
@dataclass(frozen=True)
class InjectedFault:
    """A fault ``at_s`` seconds into the ``run``-th motion since power-up, or from power-up on (``run`` 0).

    ===================  ==========================================================================
    ``kind``, in a run
    ``stall``            the main loop loses ``ms``
    ``input``            the pin ``name`` gets ``level`` 0 or 1
    ``block``            the joint ``joint``, from 0, is blocked from then on
    ``slip``             its encoder turns by ``counts``
    ``silence``          the serial cable is unplugged for ``ms``
    ``hang``             the program hangs
    ``crash``            the next read of the time raises
    from power-up on
    ``dead_pin``         the pin ``name`` does not toggle
    ``short``            of two pins, ``name`` "A15-A1", the second toggles with the first
    ``half_clock``       TIM2 counts at half its rate
    ``slow_flash``       each flash operation takes ``ms`` more
    ``late_interrupts``  interrupts are late by ``ms``
    ``dead_stream``      stream ``joint`` of DMA1 serves no request
    ===================  ==========================================================================
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
    """Options of ``launch``; the default is a new, undamaged board."""

    flash_dir: Path | str | None = None
    """The folder of its flash; None: a temporary one."""
    virtual_time: bool = True
    """Run motions as fast as possible; otherwise in real time."""
    edge_log: Path | str | None = None
    """File for all edges of the pins; ``armtempo.simulator.edgelog`` reads it."""
    interpreter: Path | str | None = None
    """MicroPython or CPython; None: $ARMTEMPO_MICROPYTHON, ``micropython`` on PATH, or this Python."""
    arm: Arm | None = None
    """The arm moved by its motors, with their ``model``; None: ideal motors of the arm that the board is set up for."""
    start_deg: Sequence[float] | None = None
    """Posture at power-up, degrees (J,); None: the home posture."""
    seed: int = 0
    """Seed of the board's id and of its arm's scatter."""
    faults: Sequence[InjectedFault] = ()
    power_cut_at: int = 0
    """The power fails during this flash operation, counted from 1; 0: never."""
    deployed: bool = False
    """Run the program in the flash (from ``armtempo deploy``) instead of the installed one."""
    flash_blocks: int | None = None
    """Size of the flash; None: the chip's."""
    instant_flash: bool = False
    """The flash is written in no time; otherwise it takes the times of the data sheet, while the chip stands still."""
    button_s: float = 0.0
    """How long the user button is held from power-up on: 0.6 to 1.2 for the safe mode, 1.2 to 1.8 for a new file
    system."""
    sd_card: Path | str | None = None
    """Folder used as an SD card in the board."""
    damage: str = ""
    """Simulated damage of the flash: ``"no file system"``, ``"unreadable"`` or ``""``."""
    machine: str = DEFAULT_MACHINE
    """The machine for which the firmware says it was built."""


@dataclass(frozen=True, kw_only=True)
class ProcessOptions:
    """The options of ``main.py``, in a JSON file. Paths are absolute."""

    flash: str
    """Folder that is the board's ``/flash``."""
    sources: list[str]
    """Folders with the packages of the board program, for its pin table and the layout of the arm record."""
    program: list[str]
    """Folders with the board program's packages, run as if deployed; empty: only what is in the flash."""
    flash_blocks: int | None
    """Size of the flash; None: that of an STM32F4DISC's file system."""
    instant_flash: bool
    speed: float
    """Motions run at this multiple of real time; 0: as fast as possible."""
    edge_log: str | None
    unique_id: str
    """24 hex digits."""
    dma_preload: bool = True
    """DMA streams fetch one word ahead, as on the chip in direct mode (RM0090 10.3.12)."""
    power_cut_at: int
    button_ms: float
    sd_card: str | None
    damage: str
    """A kind of damage of ``chip/flash.py``."""
    machine: str
    turn_us: int = 1000
    """Time of a pass of the program's main loop on the chip in addition to its simulated calls."""
    arm: dict[str, Any] | None
    """The arm from ``describe``; None: ideal motors for the arm record in the flash."""
    up: str
    """File that is made when the program has started."""
    seed: int
    faults: list[InjectedFault]

    def write(self, path: Path) -> None:
        """Write the file for ``main.py``."""
        path.write_text(json.dumps(asdict(self)))


def unique_id(seed: int) -> str:
    """A virtual board's id, 24 hex digits, different for each seed."""
    return (VIRTUAL_ID + hashlib.sha256(b"virtual board %d" % seed).hexdigest())[:24]


def describe(arm: Arm, start_deg: Sequence[float] | None = None) -> dict[str, Any]:
    """The fields of the arm record and, for each joint, its motor's angle at power-up, its drive's model, and its angle
    by those of all motors (none for a joint that has its motor alone).

    ``start_deg`` (J,): None for the home posture. Raises InputError for an impossible model.
    """
    head, rows, _ = armrecord.unpack(encode.arm_record(arm))
    gears = arm.transmission
    angles = gears.motors_deg(start_deg if start_deg is not None else arm.home_deg).tolist()
    shares = [[] if gears.is_alone(number) else row for number, row in enumerate(gears.inverse.tolist())]
    for number, row in enumerate(rows):
        if gears.matrix[number, number] < 0.0:  # the record's switches are those of the motor's directions
            row["limit_low"], row["limit_high"] = row["limit_high"], row["limit_low"]
    return {
        "head": head,
        "joints": [
            {**row, "start_deg": angle, "by_motors": by_motors, **_joint(joint)}
            for row, angle, by_motors, joint in zip(rows, angles, shares, arm.driven, strict=True)
        ],
    }


def _joint(joint: DrivenJoint) -> dict[str, Any]:
    model, motor = joint.model, joint.motor
    if model.holding_torque_nm and not (model.inertia_kg_m2 or model.rotor_inertia_kg_m2):
        raise InputError(
            f"{joint.name}: model.holding_torque_nm without an inertia",
            f"give model.{joint.unit.key('inertia_kg_m2')} or model.rotor_inertia_kg_m2 in the arm file",
        )
    return {
        "steps_per_deg": motor.steps_per_deg,
        "gear_ratio": motor.reduction,
        "slides": joint.slides,
        "microsteps": motor.microsteps,
        "low_deg": joint.switches.low_deg,
        "high_deg": joint.switches.high_deg,
        "model": asdict(model) | {"inertia_kg_m2": joint.moved_kg_m2, "gravity_torque_nm": joint.weight_nm},
        "encoder_on_motor": joint.encoder is not None and joint.encoder.on == "motor",
    }
