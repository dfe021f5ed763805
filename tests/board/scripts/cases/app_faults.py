"""Faults and exceptions: what moves is frozen, the host is told, and nothing starts before it is cleared."""

# all cases: slow on CPython

import cases

from app_rig import connected, ends_of, start, state  # isort: skip  it puts the stand-ins into place

from armtempo_board.app import app as app_module
from armtempo_shared import codes, wire


def case_fault_stays_until_cleared():
    app, host = connected()
    start(host)
    app.controller.board.engine.advance(1)
    (
        app.controller.board.engine.fault,
        app.controller.board.engine.fault_joint,
        app.controller.board.engine.moving,
    ) = (
        42,
        1,
        False,
    )
    assert state(host) == "fault"
    assert ends_of(host)[-1] == ("fault", (1, 42, 1, 8400000, 8400000))
    assert start(host) == ("error", "fault_pending", 1, 42)
    assert host.ask("home", (3,), bytes(8)) == ("error", "fault_pending", 1, 42)
    assert host.ask("clear")[0] == "ok"
    assert state(host) == "idle"
    assert start(host)[0] == "ok"
    assert len(ends_of(host)) == 1


def case_exception_becomes_a_fault():
    app, host = connected()
    start(host)
    app.controller.board.engine.explode = ValueError("deliberate")
    host.turn()
    assert state(host) == "fault"
    kinds = [kind for kind, _ in ends_of(host)]
    assert sorted(kinds) == ["fault", "notice"]
    assert "deliberate" in next(rest for kind, _, rest in host.events if kind == "notice")
    assert host.ask("status")[1][1] == 44
    assert app.controller.board.engine.calls[-1] == "freeze"


def answers(host, sequence):
    """What came for a command, as often as it came."""
    found = []
    for got, number, payload in host.turn():
        if got == sequence and wire.EVENT_BY_ID[number][0] in ("ok", "error"):
            found.append((number, bytes(payload)))
    return found


def failing_command(error):
    """The answers to a command in which an exception comes, and to its repeat; how often it was carried out."""
    app, host = connected()
    calls = []

    def explode():
        calls.append(1)
        raise error

    app.controller.board.store().names = explode
    sequence = host.send("list", (0,))
    first = answers(host, sequence)
    host.send("list", (0,), sequence=sequence)
    again = answers(host, sequence)
    assert state(host) == "fault"
    return first, again, calls


def case_exception_in_a_command_is_answered_once_and_becomes_a_fault():
    for error, code in ((ValueError("deliberate"), codes.FAILED), (MemoryError(), codes.NO_MEMORY)):
        first, again, calls = failing_command(error)
        assert len(first) == 1 and first == again and len(calls) == 1, (first, again, calls)
        number, payload = first[0]
        assert wire.EVENT_BY_ID[number][0] == "error" and payload[1] == code, payload


class Unprintable(Exception):
    """Telling of it takes more memory than there is."""

    def __str__(self):
        raise MemoryError


def case_a_failure_that_cannot_be_told_is_a_failure_all_the_same():
    app, host = connected()
    start(host)
    app.controller.board.engine.explode = Unprintable()
    tell = app_module._traceback
    app_module._traceback = lambda error: str(error)
    try:
        host.turn()
    finally:
        app_module._traceback = tell
    assert state(host) == "fault"
    assert app.controller.board.engine.calls[-1] == "freeze"
    assert "no memory" in next(rest for kind, _, rest in host.events if kind == "notice")


def case_endless_exceptions_end_the_program():
    app, host = connected()
    app.link.poll = None
    try:
        host.turn()
    except TypeError:
        return
    raise AssertionError("went on")


def case_whatever_ends_the_loop_freezes_what_moves():
    app, host = connected()
    app.controller.halt()
    assert "freeze" not in app.controller.board.engine.calls
    start(host)
    app.controller.halt()
    assert app.controller.board.engine.calls[-1] == "freeze"
    assert not app.controller.moving()


class Failing:
    def show(self, state):
        raise ValueError("deliberate")


def case_a_failing_led_freezes_what_moves():
    from armtempo_board.app import program

    app, host = connected()
    start(host)
    program.app = app
    try:
        program.run(Failing(), None, None)
    except ValueError:
        assert app.controller.board.engine.calls[-1] == "freeze"
        return
    raise AssertionError("went on")


def case_watchdog_bite_is_reported():
    _, host = connected(homed=False, fault=45)
    assert host.ask("status")[1][1] == 45
    assert start(host) == ("error", "fault_pending", 255, 45)
    host.ask("clear")
    assert state(host) == "unhomed"


cases.run(globals())
