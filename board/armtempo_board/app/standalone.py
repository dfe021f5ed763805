"""``armtempo_board.replay("feed")``: runs one stored motion from the REPL, without a host."""

import micropython
import pyb
from armtempo_shared.messages import NO_JOINT
from micropython import const

from armtempo_board.app import program
from armtempo_board.app.app import App
from armtempo_board.app.watchdog import Watchdog
from armtempo_board.code_names import name_of
from armtempo_board.errors import Refused
from armtempo_board.motion import endpoints

TYPE_CHECKING = False
if TYPE_CHECKING:
    from armtempo_board.app.controller import Controller

_CTRL_C = const(3)
_ONLY = const(0)


class _Nobody:
    """Replaces the serial port, which the REPL uses."""

    def readinto(self, *arguments: object) -> None:
        """No input."""

    write = readinto  # and no output


def replay(name: str = "", root: str = program.ROOT) -> None:
    """Run a stored motion (default: the default motion), and print how it ended.

    If the position is unknown, the arm must be at the start of the motion: calling this declares it. Ctrl-C
    brakes, a second one freezes.
    """
    nobody = _Nobody()
    app = program.app = program.app or App(nobody, root)
    controller = app.controller
    board = controller.board
    port, app.link.stream = app.link.stream, nobody
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
        if unknown:
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
    while controller.moving():
        app.run_once()
        watchdog.feed()
        if port.readinto(byte) and byte[_ONLY] == _CTRL_C and controller.moving():
            controller.stop(presses)
            presses = 1
    app.run_once()
