"""An arm as JSON, for run folders of motions without a plan."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from armtempo.basics import json_codec, json_text
from armtempo.basics.atomic_file import os_reason, replace_text
from armtempo.basics.errors import InputError
from armtempo.model import boards, pin_use
from armtempo.model.arm import Arm
from armtempo.model.outputs import KINDS, SWITCH, Output
from armtempo.model.parts import Joint

FORMAT = "armtempo arm"
VERSION = 1
_AGAIN = "restore it from a copy, or run again"


def save(arm: Arm, path: Path) -> None:
    """Write the arm, atomically; raises InputError if the file cannot be written."""
    content = {"format": FORMAT, "version": VERSION, "arm": json_codec.encode(arm)}
    replace_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def load(path: Path) -> Arm:
    """The arm of such a file; raises InputError if it is invalid or damaged, or no joint can be driven."""
    try:
        content: Any = json_text.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {os_reason(error)}", _AGAIN) from None
    if not isinstance(content, dict) or (content.get("format"), content.get("version")) != (FORMAT, VERSION):
        raise InputError(f"{path}: is not an arm of format {FORMAT!r}, version {VERSION}", _AGAIN)
    arm: Arm = json_codec.decode(Arm, content.get("arm"), f"{path}: arm")
    check(arm, f"{path}: arm", _AGAIN)
    return arm


def check(arm: Arm, where: str, hint: str) -> None:
    """Check what types cannot express: limits, motors and encoders of the driven joints are usable, no value is 0.

    Raises InputError with ``hint``.
    """
    for joint in arm.joints:
        if problem := _problem(joint):
            raise InputError(f"{where}: {joint.name}: {problem}", hint)
    if arm.board not in boards.BOARDS:
        raise InputError(f"{where}: board {arm.board!r} is not known", hint)
    for output in arm.outputs:
        if problem := _output_problem(output):
            raise InputError(f"{where}: output {output.name!r}: {problem}", hint)
    for pin in pin_use.problems(arm):
        raise InputError(f"{where}: {pin.where}: {pin.what}", hint)

    for posture in arm.postures:
        if problem := arm.posture_problem(posture):
            raise InputError(f"{where}: posture {posture.name!r}: {problem}", hint)


def _output_problem(output: Output) -> str:
    if output.kind not in KINDS:
        return f"its kind {output.kind!r} is not known"
    if output.kind != SWITCH and output.frequency_hz <= 0:
        return "its frequency_hz must be above 0"
    if output.range[0] >= output.range[1]:
        return "its angles_deg must increase"
    return ""


def _problem(joint: Joint) -> str:
    if joint.motor is None:
        return ""
    if joint.limits is None or min(joint.limits.values) <= 0:
        return "has no limits above 0"
    return ""
