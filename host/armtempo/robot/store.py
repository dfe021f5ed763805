"""Motions and sequences in the flash of a board."""

from __future__ import annotations

from pathlib import Path

from armtempo_shared import program
from armtempo_shared.sequence import KIND_BYTES, MAGIC

from armtempo.basics.arguments import checked_as
from armtempo.basics.errors import InputError
from armtempo.basics.progress import Progress
from armtempo.encoding import encoded_motion, encoded_sequence
from armtempo.encoding.encoded_motion import EncodedMotion, MotionKey
from armtempo.link.board_messages import StoredMotion
from armtempo.model.arm import Arm
from armtempo.model.job import NAME_RULE, is_name
from armtempo.model.plan import Plan
from armtempo.model.sequence_plan import SequencePlan
from armtempo.robot import sequence_run, stored_motion
from armtempo.robot.connection import Connection


@checked_as("Board")
class BoardStore:
    """``Board.store``: motions and sequences in the flash."""

    def __init__(self, board: Connection) -> None:
        self._board = board

    def upload(
        self,
        motion: Plan | EncodedMotion | Path | str,
        name: str | None = None,
        default: bool = False,
        progress: Progress | None = None,
        replace: bool = False,
    ) -> EncodedMotion:
        """Store a motion, unless the board already has it; ``progress`` counts bytes.

        ``motion``: a plan or its file. ``name``: on the board; default: from the job's name. ``default``: let
        the board's button start it. ``replace``: replace another motion of this name; if that was the
        default, the button starts nothing. Raises LinkError if there is such a motion and ``replace`` is
        false, or the board is set up for another arm.
        """
        if isinstance(motion, Path | str):
            motion = Plan.load(motion)
        if isinstance(motion, Plan):
            self._board.configure_for(motion)
            encoded = encoded_motion.of_plan(motion, name)
        else:
            self._board.configure(motion.arm)
            encoded = motion
        stored_motion.store(self._board.client, encoded.name, encoded.data, progress, replace)
        if default:
            self._board.client.set_default(encoded.name)
        return encoded

    def upload_sequence(
        self,
        sequence: SequencePlan,
        default: bool = False,
        progress: Progress | None = None,
        replace: bool = False,
    ) -> MotionKey:
        """Store a planned sequence and its motions; arguments and errors as in ``upload``."""
        encoded = encoded_sequence.of_plan(sequence)
        self._board.configure_for(sequence)
        key = sequence_run.store(self._board.client, encoded, progress, replace)
        if default:
            self._board.client.set_default(key.name)
        return key

    def list(self) -> tuple[StoredMotion, ...]:
        """The stored motions and sequences."""
        return tuple(self._board.client.stored())

    def read(self, name: str, arm: Arm | Path | str | None = None) -> EncodedMotion:
        """Read a stored motion back.

        ``arm``: the arm it was made for; default: the board's. Raises InputError if the record is damaged or
        does not fit the arm.
        """
        data = self._board.client.fetch(stored_name(name))
        if data.startswith(MAGIC[:KIND_BYTES]):
            raise InputError(f"{name!r} is a sequence, not a motion", f"run it with: armtempo run {name}")
        if data.startswith(program.MAGIC[:KIND_BYTES]):
            raise InputError(f"{name!r} is a program, not a motion", f"run it with: armtempo run {name}")
        return encoded_motion.of_record(name, data, self._board.known_arm() if arm is None else Arm.of(arm))

    def remove(self, name: str) -> None:
        """Remove a stored motion."""
        self._board.client.remove(stored_name(name))

    def rename(self, old: str, new: str) -> None:
        """Give a stored motion another name."""
        self._board.client.rename(stored_name(old), stored_name(new))

    def set_default(self, name: str) -> None:
        """Set the motion, sequence or program that the board's button starts; "" for none."""
        self._board.client.set_default(stored_name(name) if name else name)


def stored_name(name: str) -> str:
    """``name`` if it is valid for a stored motion; raises InputError otherwise."""
    if not is_name(name):
        raise InputError(
            f"{name!r} is not a valid name of a motion on the board",
            f"give the name of a stored motion: {NAME_RULE}; armtempo.Plan.load reads a file",
        )
    return name
