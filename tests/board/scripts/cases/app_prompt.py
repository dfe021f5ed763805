"""How the program is left for MicroPython's prompt: by command or Ctrl-C, not by noise, not while moving."""

# all cases: slow on CPython, not emulated

import sys

import cases

from app_rig import connected, start  # isort: skip  it puts the stand-ins into place

from armtempo_board import prompt
from armtempo_shared import wire
from stand_in import Clock, Port

CTRL_C = b"\r\x03\r\x01"
"""What mpremote begins with."""


def leaves_by_ctrl_c(app, host):
    """Within a few turns; what comes after is left to the prompt."""
    host.port.inbox.extend(CTRL_C)
    for _ in range(10):
        if not app.left():
            host.turn(1)
    assert app.left()
    assert bytes(host.port.inbox) == b"\x01"


def case_repl_is_reached_by_ctrl_c_when_idle_only():
    app, host = connected()
    start(host)
    host.turn(1000)
    host.port.inbox.extend(CTRL_C)
    host.turn(1000)
    assert not app.left()
    app.controller.board.engine.finish()
    host.turn(1000)
    assert not app.left()
    leaves_by_ctrl_c(app, host)


def case_noise_does_not_open_the_repl():
    app, host = connected()
    host.turn(1000)
    for noise in (b"\r\r\r\r", b"x\x03\x03\r", b"\x03", b"\xa5\x03\x00\x03\x03\x03\x03", b"\n\r\x03"):
        host.port.inbox.extend(noise)
        host.turn(40)
        host.port.inbox.extend(wire.frame(1, 2, b""))
        host.turn(1000)
        assert not app.left(), noise


def case_line_ends_alone_do_not_open_the_repl():
    """A terminal's Enter, before the first frame and after one."""
    for clear in (False, True):
        request = prompt.PromptRequest()
        if clear:
            request.clear()
        assert not any([request.comes(byte, 1000) for byte in b"\r\r\r\r"]), clear
        assert request.comes(3, 1000)


def case_repl_is_reached_right_behind_a_frame():
    """A host program that starts mpremote; the port's buffer may hold both."""
    app, host = connected()
    host.turn(1000)
    host.send("status")
    leaves_by_ctrl_c(app, host)


def case_leave_answers_first():
    app, host = connected()
    assert host.ask("leave") == ("ok", (), b"")
    assert app.left()


class Here:
    """In the place of ``os`` and ``time``."""

    terminals = []

    def dupterm(self, port, index):
        self.terminals.append(port)

    def ticks_ms(self):
        Clock.now_ms += 1
        return Clock.now_ms

    def ticks_diff(self, end, start):
        return end - start

    def sleep_ms(self, wait_ms):
        """Time continues by itself."""


def case_a_program_that_ended_by_itself_lets_no_frame_reach_the_prompt():
    port = Port()
    frames = b"".join([wire.frame(number, 4, bytes((3, 3, 13, 4))) for number in range(200)])
    assert b"\x04" in frames and b"\x03" in frames
    port.inbox.extend(frames + bytes(16))
    sys.modules["pyb"].USB_VCP = lambda: port
    prompt.os = prompt.time = Here()
    asked = []
    read = port.readinto

    def readinto(buffer, count):
        if not port.inbox and not asked:  # all frames are gone; now mpremote comes, after quiet
            Clock.now_ms += 100
            asked.append(1)
            port.inbox.extend(CTRL_C)
        return read(buffer, count)

    port.readinto = readinto
    prompt.wait()
    assert asked and bytes(port.inbox) == b"\x01", port.inbox
    assert Here.terminals == [None, port]


def case_begun_again_it_waits_for_a_greeting():
    app, host = connected()
    host.ask("leave")
    app.enter()
    assert not app.left()
    assert host.ask("status")[:2] == ("error", "no_session")
    assert host.hello()[0] == "ok"
    assert host.ask("status")[0] == "ok"


cases.run(globals())
