"""Where a virtual board's arm stands, kept from one command to the next beside the folder of its flash.

A real board stays powered between two commands and knows its position; a virtual one, ``sim:FOLDER``, ends with each.
"""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from armtempo_shared import wire

from armtempo.basics import json_codec
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError, LinkError
from armtempo.encoding import encode
from armtempo.link.client import Client
from armtempo.model.arm import Arm
from armtempo.ports import names


@dataclass(frozen=True)
class KeptPosition:
    """The joints' commanded steps when the board was closed."""

    arm_crc: int
    """Of the board's arm record."""
    steps: tuple[int, ...]

    def angles_deg(self, arm: Arm | None) -> list[float] | None:
        """Where the motors of ``arm`` stand; None if it is another arm: at home."""
        if arm is None or wire.record_crc(encode.arm_record(arm)) != self.arm_crc:
            return None
        return [float(angle) for angle in arm.transmission.angles_of_steps(self.steps)]


def _file(port: str) -> Path | None:
    """The file of a port; None for a port whose board keeps nothing, or keeps it itself."""
    flash = names.sim_flash(port) if names.is_sim(port) else None
    return flash and flash.with_name(f"{flash.name}-position.json")


def read(port: str) -> KeptPosition | None:
    """The position that was kept; None if there is none, or its file is damaged: the position is unknown then."""
    file = _file(port)
    try:
        values = json.loads(file.read_text(encoding="utf-8")) if file else None
        return json_codec.decode(KeptPosition, values, str(file)) if values else None
    except (OSError, ValueError, InputError):
        return None


def take(client: Client, port: str, kept: KeptPosition | None) -> None:
    """Declare it to the board, if that has the same arm; then forget it: a board that is killed leaves no position."""
    if kept and kept.arm_crc == client.info.arm_crc:
        with suppress(LinkError):
            client.home(kept.steps)
    if (file := _file(port)) is not None:
        file.unlink(missing_ok=True)


def keep(client: Client, port: str) -> None:
    """Write the position of a board that is being closed, if it is at rest and knows that of all joints."""
    file = _file(port)
    if file is None:
        return
    with suppress(LinkError, InputError):  # without it the position is unknown, which is safe
        status = client.status()
        steps = status.positions.commanded_steps
        if not status.moving and steps and all(map(status.joint_known, range(len(steps)))):
            replace_text(file, json.dumps(json_codec.encode(KeptPosition(client.info.arm_crc, steps))) + "\n")
