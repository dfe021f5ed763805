"""How the program is left for MicroPython's prompt: by command or Ctrl-C, not by noise, not while moving."""

import cases
from app_rig import connected, start
from armtempo_shared import wire

CTRL_C = b"\r\x03\r\x01"
"""What mpremote begins with."""


def leaves_by_ctrl_c(app, host):
    """Within a few turns; what comes behind is left to the prompt."""
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
    app.controller.engine.finish()
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


def case_begun_again_it_waits_for_a_greeting():
    app, host = connected()
    host.ask("leave")
    app.enter()
    assert not app.left()
    assert host.ask("status")[:2] == ("error", "no_session")
    assert host.hello()[0] == "ok"
    assert host.ask("status")[0] == "ok"


cases.run(globals())
