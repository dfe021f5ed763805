"""Stored motions and sequences: ``armtempo upload``, ``list``, ``show``, ``remove`` and ``rename``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np
from armtempo_shared.program import SUFFIX

from armtempo.basics.errors import InputError
from armtempo.basics.text import aligned
from armtempo.cli import options, posture, programs, resolve, results
from armtempo.cli.options import BoardOptions
from armtempo.cli.results import ProgressBar
from armtempo.encoding import encoded_plan
from armtempo.encoding.encoded_plan import Encoded
from armtempo.link.board_messages import StoredMotion
from armtempo.model.arm import Arm
from armtempo.robot.board import Board
from armtempo.robot.board_state import record_crc
from armtempo.robot.store import what_is_old


@click.command("upload")
@click.argument("file", type=options.PATH)
@click.option("--name", metavar="NAME", help="Name on the board; default: the job's name.")
@click.option("--default", "as_default", is_flag=True, help="Let the board's button start it.")
@options.force("another motion of this name on the board")
@options.board(options.arm_of_file, options.replace_arm, options.altered)
def upload(file: Path, name: str | None, as_default: bool, force: bool, given: BoardOptions) -> None:
    """Store a motion, a sequence or a program on the board.

    FILE: written by 'armtempo plan', or a program in MicroPython ('armtempo help programs'), NAME.py.
    """
    if file.suffix == SUFFIX:
        if name not in (None, file.stem):
            raise InputError(f"--name {name}: a program has the name of its file", "rename the file")
        programs.upload_and_report(file, as_default, force, given)
        return
    plan = resolve.load_plan(file, given.arm_path, given.altered)
    encoded = encoded_plan.of_plan(plan, name)
    with resolve.board(given, encoded.arm) as board:
        board.configure(encoded.arm, replace=given.replace_arm)
        with ProgressBar("uploading") as progress:
            board.upload(encoded, default=as_default, progress=progress, replace=force)
        virtual = board.info.virtual
    size, stored = {"size_bytes": len(encoded.data)}, f"{len(encoded.data)} bytes stored"
    if encoded.is_sequence:
        number = len(encoded.legs)
        size, stored = {"motions": number}, f"sequence and {number} motions stored"
    where = " on a virtual board" if virtual else ""
    values = {"name": encoded.name, "sequence": encoded.is_sequence, **size, "virtual": virtual}
    results.show(given.as_json, values, [f"{encoded.name}: {stored}{where}"])


@click.command("list")
@options.board(options.arm_of_board)
def list_motions(given: BoardOptions) -> None:
    """List what is stored on the board, and what is old.

    Motions with their first and last postures, sequences and programs. The default, which the board's button
    starts, is marked *.
    """
    with resolve.board(given) as board:
        found = board.list()
        arm = _arm_of(board, given.arm_path)
        if given.as_json:
            values = [{**_listed(one), "old": _old(board, one, arm)} for one in found]
            results.show_json({"virtual": board.info.virtual, "motions": values})
            return
        if board.info.virtual:
            results.echo("on a virtual board:")
        results.echo(f"{'name':<26}{'bytes':>8}{'joints':>8}{'seconds':>10}  checksum")
        for entry in found:
            results.echo(_row(entry))
            for line in (*_ends(board, entry, arm), *filter(None, [_old(board, entry, arm)])):
                results.echo(f"    {line}")


def _listed(entry: StoredMotion) -> dict[str, Any]:
    return {
        "name": entry.name,
        "sequence": entry.sequence,
        "program": entry.program,
        "size_bytes": entry.size,
        "crc": entry.crc,
        "joints": entry.joints,
        "duration_s": entry.duration_s,
        "default": entry.default,
    }


def _arm_of(board: Board, arm_path: Path | None) -> Arm | None:
    """The arm that the board is set up for; None if it is not known."""
    named = resolve.named_arm(arm_path)
    if named is not None and record_crc(named) != board.info.arm_crc:
        resolve.remark_other_arm(named)
        named = None
    try:
        return resolve.arm_of_board(board, named)
    except InputError:
        return None


def _row(entry: StoredMotion) -> str:
    name = entry.name + (" *" if entry.default else "")
    if entry.sequence:
        return f"{name:<26}{entry.size:>8}{'sequence':>18}  {entry.crc:08x}"
    if entry.program:
        return f"{name:<26}{entry.size:>8}{'program':>18}  {entry.crc:08x}"
    if not entry.joints:
        return f"{name:<26}{entry.size:>8}  damaged; upload it again or remove it"
    return f"{name:<26}{entry.size:>8}{entry.joints:>8}{entry.duration_s:>10.3f}  {entry.crc:08x}"


def _old(board: Board, entry: StoredMotion, arm: Arm | None) -> str:
    """What has changed in the arm since a motion, sequence or program was planned with it; "" for nothing."""
    return "" if arm is None else what_is_old(board.client, entry, arm)


def _ends(board: Board, entry: StoredMotion, arm: Arm | None) -> list[str]:
    """The first and last posture of a motion, if the arm is known."""
    if arm is None or not entry.joints:
        return []
    try:
        trajectory = board.read(entry.name, arm).trajectory
    except InputError as error:
        return [str(error)]
    ends = ("from", trajectory(0.0)), ("to", trajectory(trajectory.duration_s))
    return [
        f"{word:<5}{arm.texts.listed(f'{round(angle, 2) + 0.0:.2f}' for angle in angles)}"
        for word, angles in ends
    ]


@click.command("show")
@click.argument("name")
@options.board(options.arm_of_board)
def show(name: str, given: BoardOptions) -> None:
    """Show a stored motion, read back.

    NAME: as 'armtempo list' shows it.
    """
    named = resolve.named_arm(given.arm_path)
    with resolve.board(given) as board:
        motion = board.read(name, resolve.arm_of_board(board, named))
    speeds = _top_speeds_deg_s(motion)
    results.show(given.as_json, motion_values(motion, speeds), motion_lines(motion, speeds))


def _top_speeds_deg_s(motion: Encoded) -> list[float]:
    """Top speed of each driven joint, from samples."""
    times = np.linspace(0.0, motion.trajectory.duration_s, 2001)
    found: list[float] = np.abs(motion.trajectory(times, 1)).max(axis=0).tolist()
    return found


def motion_values(motion: Encoded, speeds: list[float]) -> dict[str, Any]:
    trajectory = motion.trajectory
    return {
        "name": motion.name,
        "size_bytes": len(motion.data),
        "duration_s": trajectory.duration_s,
        "degree": trajectory.joints[0].degree,
        "timing": "shared" if trajectory.shared else "per-joint",
        motion.arm.texts.list_key("start_deg"): trajectory(0.0).tolist(),
        motion.arm.texts.list_key("end_deg"): trajectory(trajectory.duration_s).tolist(),
        "joints": [
            {
                "name": joint.name,
                "duration_s": spline.duration_s,
                f"top_speed_{joint.unit.name}_s": speed,
            }
            for joint, spline, speed in zip(motion.arm.driven, trajectory.joints, speeds, strict=True)
        ],
    }


def motion_lines(motion: Encoded, speeds: list[float]) -> list[str]:
    trajectory = motion.trajectory
    found = [
        f"{motion.name}: {len(motion.data)} bytes, {trajectory.duration_s:.4f} s, "
        f"degree {trajectory.joints[0].degree}, {'shared' if trajectory.shared else 'per-joint'} timing",
        f"from {posture.format_angles(trajectory(0.0), motion.arm)}",
        f"to   {posture.format_angles(trajectory(trajectory.duration_s), motion.arm)}",
    ]
    pairs = zip(motion.arm.driven, trajectory.joints, strict=True)
    lasting = aligned([(joint.name, f"{spline.duration_s:.4f}") for joint, spline in pairs], (12, 9))
    rows = zip(lasting, speeds, motion.arm.driven, strict=True)
    return found + [f"{row} s, up to {speed:.2f} {joint.unit.name}/s" for row, speed, joint in rows]


@click.command("remove")
@click.argument("names", nargs=-1, required=True)
@options.board()
def remove(names: tuple[str, ...], given: BoardOptions) -> None:
    """Remove stored motions from the board.

    NAMES: as 'armtempo list' shows them.
    """
    with resolve.board(given) as board:
        for name in names:
            board.remove(name)
            results.progress_printer(given.as_json)(f"{name}: removed")
    if given.as_json:
        results.show_json({"removed": names})


@click.command("rename")
@click.argument("old")
@click.argument("new")
@options.board()
def rename(old: str, new: str, given: BoardOptions) -> None:
    """Give a stored motion another name.

    OLD: its name, as 'armtempo list' shows it. NEW: at most 24 of the characters a-z A-Z 0-9 - _.
    """
    with resolve.board(given) as board:
        board.rename(old, new)
    results.show(given.as_json, {"old": old, "new": new}, [f"{old} is now {new}"])
