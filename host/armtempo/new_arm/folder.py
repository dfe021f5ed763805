"""The files of a new project folder, written atomically; its arm file from a shipped arm, a URDF, or single joints."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from armtempo.basics import toml_table
from armtempo.basics.atomic_file import os_reason
from armtempo.basics.errors import InputError
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.new_arm import joint_entry
from armtempo.new_arm.joint_entry import JointEntry

ARM_FILE = "arm.toml"
_SETTINGS = """\
# What commands in this folder use if an option does not say otherwise; 'armtempo config' shows it.
arm = "arm.toml"
job = "first.toml"
port = {port}
"""
_JOB = """\
# A first motion: from the home posture through a sixth and a third of the way to the ends of the ranges.
# Each via point has one {what} for each joint with a motor, in {units}.
name = "first"
timing = "shared"
{key} = [
{rows}]
"""
_SEQUENCE = """\
# What the arm does again and again: the motion in first.toml, back home, half a second's rest, three times.
name = "cycle"
start = "home"

[[step]]
repeat = 3               # or "for ever"

[[step]]
run = "first.toml"

[[step]]
goto = "home"

[[step]]
wait_s = 0.5

[[step]]
end = "repeat"
"""
_PAGE = """\
# {name}

    armtempo check --picture arm.png    # what looks wrong about arm.toml
    armtempo plan                       # the motion in first.toml, as short as the limits allow
    armtempo deploy                     # once, for a real board: the board program
    armtempo home --arm arm.toml        # "the arm is in its home posture"; nothing moves
    armtempo run first.json             # replay and record it
    armtempo report                     # how well the arm followed
    armtempo plan sequence.toml         # a sequence: the motion, back home, again and again
    armtempo goto home
    armtempo run cycle.json
    armtempo panel                      # all of this, and more, in a browser

`armtempo.toml` names arm, job and port; the port `sim:board` is a virtual board, its flash in the folder `board`.
"""


@dataclass(frozen=True)
class ArmText:
    """The text of an arm file, not yet written."""

    text: str
    arm: Arm
    """The arm read from the text."""
    notes: tuple[str, ...] = ()
    """On what it was made from."""


def from_shipped(name: str) -> ArmText:
    """The file of a shipped arm, to be adapted to the user's motors and wiring.

    Raises InputError, with the names of the shipped arms, for another name.
    """
    files = shipped.files()
    if name not in files:
        raise InputError(
            f"{name}: no arm of that name ships with armtempo", f"give one of {', '.join(files)}"
        )
    return _checked(files[name].read_text(encoding="utf-8"))


def from_urdf(urdf: Path) -> ArmText:
    """The arm of a URDF; its motors are left as comments. Raises InputError as ``urdf_reader`` does."""
    from armtempo.new_arm import arm_text
    from armtempo.new_arm import urdf_fitting as fitting
    from armtempo.new_arm import urdf_reader as reader

    chain = reader.read(urdf, None, None)
    made = _checked(arm_text.arm_text(chain, fitting.fit(chain), urdf))
    return replace(made, notes=tuple(arm_text.notes(chain, ARM_FILE)))


def from_joints(name: str, joints: Sequence[JointEntry], modified: bool = False) -> ArmText:
    """An arm of these joints, base first. Raises InputError for values that an arm file does not allow.

    ``modified``: ``a_mm`` and ``alpha_deg`` of a joint are those from the axis before to its own, as in J. J. Craig,
    Introduction to Robotics, section 3.4. In an arm file they belong to the row before; to a constant one at the base.
    """
    base = []
    if modified:
        first = joints[0]
        if first.a_mm or first.alpha_deg:
            base = [joint_entry.constant("base", first.a_mm, first.alpha_deg)]
        behind = [*((joint.a_mm, joint.alpha_deg) for joint in joints[1:]), (0.0, 0.0)]
        joints = [
            replace(joint, a_mm=a_mm, alpha_deg=alpha_deg)
            for joint, (a_mm, alpha_deg) in zip(joints, behind, strict=True)
        ]
    tables = [joint_entry.table(joint, number, len(joints)) for number, joint in enumerate(joints, 1)]
    return _checked("\n".join([f"name = {json.dumps(name, ensure_ascii=False)}\n", *base, *tables]))


def within(arm: ArmText, workspace: Mapping[str, Sequence[float]]) -> ArmText:
    """The arm in a workspace: the numbers of its keys, one or two each. Raises InputError as an arm file."""
    if not workspace:
        return arm
    rows = [f"{key} = {values[0] if len(values) == 1 else list(values)}" for key, values in workspace.items()]
    return replace(_checked("\n".join([arm.text, "[workspace]", *rows, ""])), notes=arm.notes)


def _checked(text: str) -> ArmText:
    """Raise InputError for a text that could not be read again."""
    return ArmText(text, Arm.of_table(toml_table.parse(text, ARM_FILE)))


def write(folder: Path, arm: ArmText, port: str) -> list[Path]:
    """Make ``folder`` with the files of a project; returns their paths.

    Raises InputError, leaving nothing, if the folder exists and is not empty, or cannot be written.
    """
    check_free(folder)
    files = {ARM_FILE: arm.text, "armtempo.toml": _SETTINGS.format(port=_quoted(port))}
    if arm.arm.driven_indices:
        files["first.toml"] = _JOB.format(
            what=arm.arm.texts.position,
            units=arm.arm.texts.unit_words,
            key=arm.arm.texts.list_key("via_deg"),
            rows=_rows(arm.arm),
        )
        files["sequence.toml"] = _SEQUENCE
    files["README.md"] = _PAGE.format(name=arm.arm.name)
    try:
        _put(folder, files)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {os_reason(error)}", "choose another place") from None
    return [folder / name for name in files]


def check_free(folder: Path) -> None:
    """Raise InputError if the folder exists and is not empty."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: already exists and is not empty", "choose another name")


def _put(folder: Path, files: dict[str, str]) -> None:
    """Write the files to a temporary folder, then rename it."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    try:
        for name, text in files.items():
            (aside / name).write_text(text, encoding="utf-8")
        aside.chmod(0o755)
        if folder.exists():
            folder.rmdir()
        aside.rename(folder)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _rows(arm: Arm) -> str:
    """Via points: home, then positions towards the farther end of each range."""
    rows = []
    for share in (0.0, 1 / 6, 1 / 3):
        angles = []
        for joint in arm.driven:
            low, high = joint.range_deg
            end = high if high - joint.home_deg >= joint.home_deg - low else low
            angles.append(round(joint.home_deg + share * (end - joint.home_deg), 3))
        rows.append(f"    {angles},\n")
    return "".join(rows)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
