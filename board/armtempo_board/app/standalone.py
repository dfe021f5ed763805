"""``armtempo_board.replay("feed")``: runs a stored motion, sequence or program from the REPL, without a host."""

import micropython
import pyb
from armtempo_shared.messages import MOTION, NO_JOINT
from micropython import const

from armtempo_board import features
from armtempo_board.app import program
from armtempo_board.app.app import App
from armtempo_board.app.watchdog import Watchdog
from armtempo_board.code_names import name_of
from armtempo_board.errors import Refused
from armtempo_board.motion import endpoints

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_board.app.controller import Controller
    from armtempo_board.app.events import Events

_CTRL_C = const(3)
_ONLY = const(0)


class _Nobody:
    """Replaces the serial port, which the REPL uses."""

    def readinto(self, *arguments: object) -> None:
        """No input."""

    write = readinto  # and no output


def replay(name: str = "", root: str = program.ROOT) -> None:
    """Run a stored motion, sequence or program (default: the default one), and print how it ended.

    If the position is unknown, the arm must be at the start of the motion: calling this declares it; a sequence or
    program is refused then. Ctrl-C brakes, a second one freezes. What a program prints is shown.
    """
    nobody = _Nobody()
    app = program.app = program.app or App(nobody, root)
    controller = app.controller
    board = controller.board
    port, app.link.stream = app.link.stream, nobody
    app.commands.greeted = False  # what the board says is shown here
    watchdog = Watchdog()
    micropython.kbd_intr(-1)  # KeyboardInterrupt could occur anywhere
    try:
        _begin(controller, name or board.store().default())
        _follow(app, controller, watchdog)
        fault = board.fault()
        said = "fault: " + name_of(fault) if fault else "done"
        print(said, "at steps", [board.engine.commanded(joint) for joint in range(board.joints)])
    except Refused as refused:
        joint = refused.joint
        where = "" if joint == NO_JOINT else "joint %d" % (joint + 1)
        print("refused:", name_of(refused.code), where, refused.value or "")
    finally:
        controller.halt()
        micropython.kbd_intr(_CTRL_C)
        watchdog.leave()
        app.link.stream = port


def _begin(controller: "Controller", name: str) -> None:
    board = controller.board
    if not board.fault():
        unknown = board.all_joints_mask() & ~board.known()
        if unknown and not (features.SEQUENCES and board.store().kind(name) != MOTION):
            motion = controller.load(name)
            print("taking the posture of the arm as the start of", name)
            controller.home(
                unknown, [endpoints.start_offset(motion, joint, 0) for joint in range(board.joints)]
            )
    controller.begin(name, 0)


def _follow(app: "App", controller: "Controller", watchdog: "Watchdog") -> None:
    port = pyb.USB_VCP()
    byte = bytearray(1)
    presses = 0

    def run_once() -> None:
        nonlocal presses
        _show(app.events)
        app.run_once()
        watchdog.feed()
        if port.readinto(byte) and byte[_ONLY] == _CTRL_C and controller.moving():
            controller.stop(presses)
            presses = 1

    if features.SEQUENCES:
        app.execute_program(run_once)
    while controller.moving():
        run_once()
    _show(app.events)
    app.run_once()


def _show(events: "Events") -> None:
    """What is said to a host is shown here."""
    if features.SEQUENCES:
        events.take_failure()
    if events.notice:
        print(events.notice.decode())
        events.notice = b""
