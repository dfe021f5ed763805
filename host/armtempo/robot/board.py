"""A connected board: configure, home, move, replay, record, stop."""

from __future__ import annotations

from collections.abc import Callable, Iterator, MutableSequence
from contextlib import ExitStack, contextmanager
from functools import wraps
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, Self, TypeVar

from armtempo.basics.arguments import checked
from armtempo.basics.errors import LinkError
from armtempo.basics.progress import Progress
from armtempo.link import Client
from armtempo.link.board_messages import Hello, Status
from armtempo.model.arm import Arm
from armtempo.robot import board_state, kept_position
from armtempo.robot.board_state import BoardState
from armtempo.robot.connection import Connection
from armtempo.robot.motions import Motions
from armtempo.robot.outputs import BoardIO
from armtempo.robot.position import ArmPosition
from armtempo.robot.programs import Programs
from armtempo.robot.running import LOCK_S
from armtempo.robot.stop_request import StopRequest
from armtempo.robot.store import BoardStore

if TYPE_CHECKING:
    from armtempo.diagnosis.selftest.result import SelfTest
    from armtempo.report.run import Run

_P = ParamSpec("_P")
_R = TypeVar("_R")


def _of(role: str, method: Callable[Concatenate[Any, _P], _R]) -> Callable[Concatenate[Any, _P], _R]:
    """A method of the board that is one of its role's."""

    @wraps(method)
    def call(board: Any, /, *args: _P.args, **kwargs: _P.kwargs) -> _R:
        return method(getattr(board, role), *args, **kwargs)

    return call


@checked
class Board:
    """A board and the arm that it moves; ``connect`` gives one.

    Nothing moves before the arm's position is known (``home``), and a motion only starts if the arm is at its
    start (``goto``). Every method raises BoardError if the board refuses or a fault ends a motion, and
    LinkError if the board cannot be reached. Ctrl-C, or a ``StopRequest``, brakes a motion and raises
    Stopped.
    """

    def __init__(self, client: Client, port: str, stack: ExitStack | None = None) -> None:
        self.client = client
        """The protocol's commands one by one."""
        self.port = port
        self._shared = Connection(client, port)
        self.store = BoardStore(self._shared)
        """Motions and sequences in the board's flash."""
        self.position = ArmPosition(self._shared)
        """Where the arm is."""
        self.io = BoardIO(self._shared)
        """Outputs and inputs."""
        self.motions = Motions(self._shared)
        """What moves the arm, and what it recorded."""
        self.programs = Programs(self._shared)
        """Users' programs."""
        self._stack = stack or ExitStack()

    configure = _of("_shared", Connection.configure)
    upload = _of("store", BoardStore.upload)
    upload_sequence = _of("store", BoardStore.upload_sequence)
    list = _of("store", BoardStore.list)
    read = _of("store", BoardStore.read)
    remove = _of("store", BoardStore.remove)
    rename = _of("store", BoardStore.rename)
    set_default = _of("store", BoardStore.set_default)
    home = _of("position", ArmPosition.home)
    home_to_switches = _of("position", ArmPosition.home_to_switches)
    posture_deg = _of("position", ArmPosition.posture_deg)
    output = _of("io", BoardIO.output)
    input = _of("io", BoardIO.input)
    goto = _of("motions", Motions.goto)
    jog = _of("motions", Motions.jog)
    jog_to = _of("motions", Motions.jog_to)
    held_jog = _of("motions", Motions.held_jog)
    by_hand = _of("motions", Motions.by_hand)
    run = _of("motions", Motions.run)
    run_sequence = _of("motions", Motions.run_sequence)
    encode_program = _of("programs", Programs.encode)
    upload_program = _of("programs", Programs.upload)
    run_program = _of("programs", Programs.run)
    fetch = _of("motions", Motions.fetch)
    stop = _of("motions", Motions.stop)
    request_stop = _of("motions", Motions.request_stop)
    speed = _of("motions", Motions.speed)
    pause = _of("motions", Motions.pause)
    resume = _of("motions", Motions.resume)

    @property
    def arm(self) -> Arm | None:
        """The arm that this object last set the board up for."""
        return self._shared.arm

    @arm.setter
    def arm(self, arm: Arm | None) -> None:
        self._shared.arm = arm

    @property
    def stops(self) -> MutableSequence[StopRequest]:
        """The stop requests of running calls of this object; one that is added hears of every stop too, for work
        before a motion."""
        return self._shared.stops

    @property
    def last_jog_ends(self) -> str:
        """Why the last jog ended early; "" if it did not."""
        return self.motions.last_jog_ends

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the running or the last sequence or program, by name.

        A start of a sequence sets them to 0; a power cycle loses them.
        """
        return self.client.counters()

    @property
    def last_run(self) -> Run | None:
        """The last run that this object recorded, even if it ended early; None before the first."""
        return self.motions.last_run

    @property
    def last_sequence(self) -> Run | None:
        """The last sequence that this object recorded, even if it ended early; None before the first."""
        return self.motions.last_sequence

    def close(self) -> None:
        """Close the port; a virtual board ends. Other methods raise LinkError afterwards."""
        with self._last_turn():
            self._stack.close()

    @contextmanager
    def _last_turn(self) -> Iterator[None]:
        """While no other thread is within a command: it would open a port again that was closed under it.

        One that waits longer, for a cable that is out, finds that the board is closed.
        """
        with self.client.session.in_a_hurry(LOCK_S):
            kept_position.keep(self.client, self.port)
            self.client.session.guard(self._closed)
            yield

    def _closed(self) -> None:
        raise LinkError(f"the board on {self.port} was closed", "open it again with armtempo.connect")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            with self._last_turn():
                self._stack.__exit__(kind, value, trace)
        finally:
            self.close()

    @property
    def info(self) -> Hello:
        """The board's identity: program, protocol, arm record, memory, step rates."""
        return self.client.info

    def status(self) -> Status:
        """The board's state, its fault, and the joints' positions in steps and counts."""
        return self.client.status()

    def state(self, arm: Arm | Path | str | None = None) -> BoardState:
        """``info`` and ``status`` in one object, with the joints' names and angles in degrees.

        ``arm``: used if the board is set up for it; None: ``self.arm``.
        """
        return board_state.read(self.client, self.port).named(self.arm if arm is None else Arm.of(arm))

    def selftest(self, progress: Progress | None = None) -> SelfTest:
        """Let the board measure itself with its drivers off; ``progress`` reports the progress.

        The board is reset at the end, and its positions are unknown. Raises LinkError, before anything is
        done, if the drivers are on, a motion runs, or the program is not built into the board's firmware.
        """
        from armtempo.diagnosis.selftest import selftest  # here, as each command would wait for it

        return selftest.run(self.client, progress)

    def motor_test(
        self, arm: Arm | Path | str, ask: Callable[[str], bool], tell: Callable[[str], object] = print
    ) -> SelfTest:
        """Test directions, encoders, switches and E-stop: each joint moves slowly up to a degree there and back.

        ``ask`` asks the person at the arm (first, whether the listed joints may move) and returns True for
        yes; ``tell`` prints what to press. The result's ``data["arm_file"]`` has the lines to correct in the
        arm file. Raises ArmtempoError without a yes, LinkError if a position is unknown, both before anything
        moves.
        """
        from armtempo.robot.motor_test import MotorTest  # as in ``selftest``

        arm = Arm.of(arm)
        self.configure(arm)
        self._shared.start.home_virtual_arm(arm)
        with self._shared.stoppable(None) as stop:
            return MotorTest(self.client, arm, stop, ask, tell).run()

    def clear(self) -> None:
        """Clear a fault; raises BoardError while its cause persists."""
        self.client.clear()
