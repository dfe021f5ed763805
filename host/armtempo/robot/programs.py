"""Users' programs on a board."""

from __future__ import annotations

import reprlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from armtempo_shared.program import SUFFIX

from armtempo.basics.arguments import checked_as
from armtempo.basics.errors import InputError, LinkError
from armtempo.basics.progress import Progress
from armtempo.encoding import made_with
from armtempo.encoding.encoded_plan import MotionKey
from armtempo.link import Client
from armtempo.link.board_messages import Notice, SequenceState
from armtempo.link.follow import Followed, SequenceFollower, SequenceWatcher
from armtempo.model.arm import Arm
from armtempo.model.job import is_name
from armtempo.model.parts import PROGRAM
from armtempo.robot import running
from armtempo.robot.connection import Connection
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.store import store

if TYPE_CHECKING:  # imported where they are used, because they load the inverse kinematics
    from armtempo.encoding.encoded_program import EncodedProgram
    from armtempo.model.user_program import UserProgram

    AnyProgram = EncodedProgram | UserProgram | Path | str

Listener = Callable[[str], object]
"""Called with each line that a program prints, and with the traceback of a failure."""


def check_memory(client: Client, encoded: EncodedProgram) -> None:
    """Raise LinkError if the board has too little memory for a program."""
    client.need("sequences", f"program {encoded.key.name!r}")
    free = client.hello().free_heap  # 0: a virtual board on CPython
    if 0 < free < encoded.heap_bytes:
        raise LinkError(
            f"program {encoded.key.name!r} needs {encoded.heap_bytes} bytes of the board's memory, with this arm "
            f"{free} are free",
            "make it shorter; with the program in the firmware more is free: 'armtempo flash'",
        )


def check_default(encoded: EncodedProgram) -> None:
    """Raise InputError for a default that is to start at power-up, but does not home the arm."""
    if encoded.arm.safety.at_power_up == PROGRAM and not encoded.program.homes:
        raise InputError(
            f'{encoded.program.path}: the arm file says at_power_up = "{PROGRAM}", but it does not home the arm, so '
            "that nothing would start",
            "begin it with cell.home(), or take the line out of the arm file",
        )


@checked_as("Board")
class Programs:
    """``Board.programs``: users' programs, stored and run."""

    def __init__(self, board: Connection) -> None:
        self._board = board

    def encode(self, program: AnyProgram, arm: Arm | Path | str) -> EncodedProgram:
        """The program of a file for this board, with the motions that it names: NAME.json beside it, or stored ones.

        Raises InputError for one that is neither, and as ``UserProgram.load``.
        """
        from armtempo.encoding import encoded_program
        from armtempo.model.user_program import UserProgram

        if not isinstance(program, UserProgram | Path | str):
            raise InputError(
                f"Board.encode_program: program is {reprlib.repr(program)}", "give its file, or a UserProgram"
            )
        arm = Arm.of(arm)
        found = program if isinstance(program, UserProgram) else UserProgram.load(program, arm)
        motions = encoded_program.motions_beside(found, arm)
        beside, stored = [motion.name for motion in motions], []
        for name, line in found.motions.items():
            if name in beside:
                continue
            kept = self._board.client.find(name)
            if kept is None or not kept.joints:
                raise InputError(
                    f"{found.path}, line {line}: no motion {name!r}",
                    f"plan it as {found.motion_file(name)}, or store it with 'armtempo upload FILE --name {name}'",
                )
            made_with.check_stored(name, self._board.client.fetch(name), arm)
            stored.append(MotionKey(name, kept.crc))
        return encoded_program.of_program(found, arm, motions, tuple(stored))

    def upload(
        self,
        program: AnyProgram,
        progress: Progress | None = None,
        replace: bool = False,
        default: bool = False,
    ) -> MotionKey:
        """Store a program with the motions that it names; a program of this name is replaced.

        ``replace``: replace something else of one of the names too. ``default``: let the board's button start it.
        Raises InputError for what is wrong in it, LinkError if the board has too little memory, or something else
        under one of the names.
        """
        from armtempo.encoding.encoded_program import EncodedProgram

        if not isinstance(program, EncodedProgram):
            program = self.encode(program, self._board.known_arm())
        if default:
            check_default(program)
        self._board.configure(program.arm)
        check_memory(self._board.client, program)
        key = store(self._board.client, program.records, progress, replace)
        if default:
            self._board.client.set_default(key.name)
        return key

    def _check_stored(self, name: str) -> None:
        """Raise InputError if a stored program, or a motion that it runs, is not as the arm is now."""
        arm, client = self._board.arm, self._board.client
        if arm is None:
            return
        from armtempo.encoding import encoded_program

        data = client.fetch(name)
        encoded_program.check_stored(name, data, arm)
        kept = [entry.name for entry in client.stored()]
        for motion in encoded_program.motions_of(data):
            if motion in kept:  # the program is told about others when it runs them
                made_with.check_stored(motion, client.fetch(motion), arm)

    def run(
        self,
        program: AnyProgram,
        listener: Listener = lambda _: None,
        watcher: SequenceWatcher = lambda _: None,
        stop: StopRequest | None = None,
        replace: bool = False,
    ) -> SequenceState:
        """Run a program, or the stored program of that name; returns its last state.

        A stored one is refused if what it or its motions were made with has changed since. ``listener`` is called with
        each line that it prints, ``watcher`` with each new state. The arm must be homed, unless the program homes it.
        Raises as ``upload``, and BoardError if a fault ends it; its traceback went to ``listener``.
        """
        with self._board.stoppable(stop) as wanted:
            if isinstance(program, str) and is_name(program):
                found = self._board.client.find(program)
                if found is None or not found.program:
                    raise InputError(f"the board has no program {program!r}", "see 'armtempo list'")
                self._check_stored(program)
                key = MotionKey(found.name, found.crc)
            else:
                key = self.upload(program, replace=replace)
            if self._board.arm is not None:
                self._board.start.home_virtual_arm(self._board.arm)
            client = self._board.client

            def take(event: Followed) -> None:
                if isinstance(event, Notice):
                    listener(event.text)

            name = key.name + SUFFIX  # the board's name of it
            with running.attended(client, wanted):
                follower = SequenceFollower(client, name, client.start(key.name, key.crc), watcher)
                running.follow(client, wanted, follower, take)
            running.raise_sequence_failure(client, follower.end, program=True)
            return follower.end
