"""Motions and sequences in the flash of a board."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from armtempo_shared import program, sequence, wire
from armtempo_shared.sequence import KIND_BYTES, SequenceData, SequenceError

from armtempo.basics.arguments import checked_as
from armtempo.basics.errors import InputError, LinkError
from armtempo.basics.progress import Progress
from armtempo.encoding import encoded_plan, flash_use, made_with
from armtempo.encoding.encoded_plan import Encoded, MotionKey
from armtempo.link import Client
from armtempo.link.board_messages import StoredMotion
from armtempo.model.arm import Arm
from armtempo.model.job import NAME_RULE, is_name
from armtempo.model.parts import PROGRAM
from armtempo.model.plan import Plan
from armtempo.robot.connection import Connection

LOG = logging.getLogger("armtempo")

_KINDS = {sequence.MAGIC[:KIND_BYTES]: "sequence", program.MAGIC[:KIND_BYTES]: "program"}
"""What records of other kinds than motions begin with."""


def what_is_old(client: Client, entry: StoredMotion, arm: Arm) -> str:
    """What has changed in the arm since a stored motion, sequence or program was made with it; "" for nothing."""
    check = made_with.check_stored
    if entry.program:
        from armtempo.encoding import encoded_program  # here, because it loads the inverse kinematics

        check = encoded_program.check_stored
    try:
        check(entry.name, client.fetch(entry.name), arm)
    except InputError as error:
        return str(error)
    return ""


def withdraw_old_default(client: Client, arm: Arm) -> str:
    """Take from the board's button what is old: the board does not know frames, tools and pallets of the arm file.

    Returns what to tell the user; "" if the default, if there is one, is as the arm is now.
    """
    default = next((entry for entry in client.stored() if entry.default), None)
    old = what_is_old(client, default, arm) if default else ""
    if not old:
        return ""
    client.set_default("")
    return f"{old} with --default: until then the board's button starts nothing"


@checked_as("Board")
class BoardStore:
    """``Board.store``: motions and sequences in the flash."""

    def __init__(self, board: Connection) -> None:
        self._board = board

    def upload(
        self,
        motion: Plan | Encoded | Path | str,
        name: str | None = None,
        default: bool = False,
        progress: Progress | None = None,
        replace: bool = False,
    ) -> Encoded:
        """Store a motion, or a sequence with its motions, unless the board already has it; ``progress`` counts bytes.

        ``motion``: a plan or its file. ``name``: of a motion on the board; default: from the job's name.
        ``default``: let the board's button start it; at power-up it does not start, of which the logger "armtempo"
        warns on an arm with ``at_power_up``. ``replace``: replace something else of this name; if that was the
        default, the button starts nothing. Raises LinkError if there is something else and ``replace`` is
        false, or the board is set up for another arm.
        """
        found = encoded_plan.of_any(motion, name)
        self._board.configure_for(found.arm, found.plan)
        store(self._board.client, found.records, progress, replace)
        if default:
            self._board.client.set_default(found.name)
            if found.arm.safety.at_power_up == PROGRAM:
                LOG.warning(
                    "the board's button starts %r, but nothing starts at power-up: only a program that homes the arm "
                    "does ('armtempo help programs')",
                    found.name,
                )
        return found

    def upload_sequence(
        self,
        sequence: Plan,
        default: bool = False,
        progress: Progress | None = None,
        replace: bool = False,
    ) -> MotionKey:
        """As ``upload``; returns the sequence's name and checksum."""
        return self.upload(sequence, None, default, progress, replace).key

    def list(self) -> tuple[StoredMotion, ...]:
        """The stored motions and sequences."""
        return tuple(self._board.client.stored())

    def read(self, name: str, arm: Arm | Path | str | None = None) -> Encoded:
        """Read a stored motion back.

        ``arm``: the arm it was made for; default: the board's. Raises InputError if the record is damaged or
        does not fit the arm.
        """
        arm = self._board.known_arm() if arm is None else Arm.of(arm)
        found = encoded_plan.of_board(stored_name(name), arm, self._board.client.fetch)
        if found.is_sequence:
            raise InputError(f"{name!r} is a sequence, not a motion", f"run it with 'armtempo run {name}'")
        return found

    def remove(self, name: str) -> None:
        """Remove a stored motion."""
        self._board.client.remove(stored_name(name))

    def rename(self, old: str, new: str) -> None:
        """Give a stored motion another name."""
        self._board.client.rename(stored_name(old), stored_name(new))

    def set_default(self, name: str) -> None:
        """Set the motion, sequence or program that the board's button starts; "" for none."""
        self._board.client.set_default(stored_name(name) if name else name)


def store(
    client: Client,
    records: Sequence[tuple[str, bytes]],
    progress: Progress | None = None,
    replace: bool = False,
) -> MotionKey:
    """Store records that the board does not have, each under its name; returns the key of the last one.

    That is a motion, or the sequence or program of the motions before it, so that what is stored is always complete.
    Motions of an earlier sequence of its name that are no longer needed are removed. Raises LinkError if the board has
    something else under one of the names and ``replace`` is false, or its flash cannot take all; a program replaces
    one of its name.
    """
    keys = [MotionKey(name, wire.record_crc(data)) for name, data in records]
    (name, data), whole = records[-1], sum(len(data) for _, data in records)
    kind = _KINDS.get(data[:KIND_BYTES])
    if kind:
        client.need("sequences", f"{kind} {name!r}")
    kept = {entry.name: entry for entry in client.stored()}
    old = kept.get(name)
    legs = _legs_of(client, old) if old and old.sequence else {}
    if old and old.program and kind == "program":
        legs[name] = old.crc
    for key in keys if not replace else ():
        found = kept.get(key.name)
        if found and found.crc not in (0, key.crc, legs.get(key.name)):
            raise _has_another(found)
    if len(records) > 1:  # one alone is refused by the board
        _check_flash(client, records, keys, kept)
    done = 0
    for key, (_, data) in zip(keys, records, strict=True):
        if key.name not in kept or kept[key.name].crc != key.crc:
            client.upload(key.name, data, _from(done, whole, progress))
        done += len(data)
        if progress is not None:
            progress(done, whole)
    for leg in legs.keys() - {key.name for key in keys}:
        if leg in kept and kept[leg].crc == legs[leg]:
            client.remove(leg)
    return keys[-1]


def _check_flash(
    client: Client,
    records: Sequence[tuple[str, bytes]],
    keys: Sequence[MotionKey],
    kept: dict[str, StoredMotion],
) -> None:
    """Raise LinkError if the flash cannot take all records, each of which is written before an old one is removed."""
    new = [
        (key.name, len(data))
        for key, (_, data) in zip(keys, records, strict=True)
        if key.name not in kept or kept[key.name].crc != key.crc
    ]
    free = whole = client.hello().free_flash
    free -= flash_use.of_names([name for name, _ in new if name not in kept])
    fits = True
    for name, size in new:
        fits = fits and size + flash_use.BLOCK <= free
        free -= flash_use.in_blocks(size) - (flash_use.in_blocks(kept[name].size) if name in kept else 0)
    if not fits:
        raise LinkError(
            f"{len(new)} records take {whole - free + flash_use.BLOCK} bytes of the board's flash, of which {whole} "
            "are free; nothing was stored",
            "remove what is not needed ('armtempo list', 'armtempo remove'), or plan fewer motions, such as for a "
            "part of the pallet",
        )


def _from(done: int, whole: int, progress: Progress | None) -> Progress | None:
    """The progress of a part of ``whole`` bytes, of which ``done`` were before it."""
    return None if progress is None else lambda at, _: progress(done + at, whole)


def _has_another(found: StoredMotion) -> LinkError:
    kind = "sequence" if found.sequence else "program" if found.program else "motion"
    button = ", which its button starts" if found.default else ""
    lasting = f"{found.duration_s:.3f} s, " if found.joints else ""
    return LinkError(
        f"the board has another {kind} {found.name!r}{button} ({lasting}checksum {found.crc:08x})",
        "replace it with --force, or store this one under another name: 'armtempo upload --name' for a motion, else "
        "the name in its file",
    )


def _legs_of(client: Client, old: StoredMotion) -> dict[str, int]:
    """Names and checksums of the motions of a stored sequence; empty if it cannot be read."""
    try:
        found = SequenceData(client.fetch(old.name))
        return dict(found.motion(index) for index in range(found.motions))
    except SequenceError:
        return {}


def stored_name(name: str) -> str:
    """``name`` if it is valid for a stored motion; raises InputError otherwise."""
    if not is_name(name):
        raise InputError(
            f"{name!r} is not a valid name of a motion on the board",
            f"give the name of a stored motion: {NAME_RULE}; armtempo.Plan.load reads a file",
        )
    return name
