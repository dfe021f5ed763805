"""Starts the board program on the hardware: serial port, watchdog, LEDs, button."""

import os

import armtempo_shared
import machine
import micropython
import pyb
from armtempo_shared import codes
from micropython import const

from armtempo_board.stepgen import step_generator  # isort: skip  # noqa: F401  nested imports cost stack: the deepest first
from armtempo_board.motion import engine  # isort: skip  # noqa: F401  and what is deep without that
from armtempo_board.motion import engine_parts  # isort: skip  # noqa: F401

from armtempo_shared.program_hash import program_crc

import armtempo_board
from armtempo_board import features
from armtempo_board.app.app import App
from armtempo_board.app.button import Button
from armtempo_board.app.leds import Leds
from armtempo_board.app.watchdog import Watchdog, has_reset
from armtempo_board.errors import Refused

if features.ALL:
    from armtempo_board.storage import measured_rates

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

ROOT = "/flash/armtempo"
_CTRL_C = const(3)
_EXCEPTION_BUFFER = const(100)
_EIGHTH_PASS = const(7)  # during a motion, LEDs, watchdog and button are served only in every eighth pass

app: "Any" = None
"""The program's App; kept when the program is left for the REPL."""


def main(root: str = ROOT) -> None:
    """Run until a host asks for the REPL."""
    global app
    micropython.alloc_emergency_exception_buf(_EXCEPTION_BUFFER)
    leds = Leds()
    button = Button()  # before the engine, which may take its pin for a sixth joint
    port = pyb.USB_VCP()
    if features.SEQUENCES:
        at_power_up = app is None and machine.reset_cause() == machine.PWRON_RESET and not button.held()
    app = app or _build(port, root)
    app.enter()
    watchdog = Watchdog()
    _detach(port)
    try:
        if features.SEQUENCES:  # noqa: SIM102  the core is without what is behind a constant alone
            if at_power_up and app.controller.board.starts_alone:
                _start_alone()
        run(leds, button, watchdog)
    finally:
        watchdog.leave()
        _attach(port)
    print("armtempo ended; Ctrl-D restarts it")


def _build(port: "pyb.USB_VCP", root: str) -> App:
    crc = program_crc(armtempo_board.__file__, armtempo_shared.__file__)
    built = App(port, root, crc, codes.WATCHDOG if has_reset() else 0)
    built.controller.board.forget_store()
    if features.ALL:
        measured_rates.read(root, built.controller.board.board_id, crc)
    return built


def run(leds: "Leds", button: "Button", watchdog: "Watchdog") -> None:
    """Run the loop until a host asks for the REPL. Stops the motion however it ends."""

    def run_once() -> None:
        app.run_once()
        try:
            _serve_panel(leds, button, watchdog)
        except Exception as error:
            app.fail(error)

    try:
        while True:
            run_once()
            try:
                if features.SEQUENCES:
                    app.execute_program(run_once)
                if app.leave_requested():
                    break
            except Exception as error:
                app.fail(error)
    finally:
        app.controller.halt()


def _serve_panel(leds: "Leds", button: "Button", watchdog: "Watchdog") -> None:
    """Serve LEDs, watchdog and button."""
    controller = app.controller
    if controller.running and app.passes & _EIGHTH_PASS:
        return
    leds.show(controller.state())
    watchdog.feed()
    pressed = button.pressed()  # a press during a motion is ignored, but it stops a sequence
    if pressed and controller.sequence:
        controller.stop(0)
    if controller.moving():
        return
    if pressed:
        _start_default("button")
    machine.idle()


if features.SEQUENCES:

    def _start_alone() -> None:
        """Start the default at power-up: as the position is unknown, only a program that homes the arm."""
        try:
            _start_default("power-up")
        except Exception as error:
            app.fail(error)


def _start_default(by: str) -> None:
    try:
        app.controller.begin(app.controller.board.store().default(), 0)
    except Refused as refused:
        app.events.note("%s: error %d" % (by, refused.code))


def _detach(port: "Any") -> None:
    os.dupterm(None, 1)
    micropython.kbd_intr(-1)
    port.init(flow=pyb.USB_VCP.RTS | pyb.USB_VCP.CTS)  # without CTS a write waits for the host


def _attach(port: "Any") -> None:
    micropython.kbd_intr(_CTRL_C)
    os.dupterm(port, 1)
