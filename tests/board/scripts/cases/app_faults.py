"""Faults and exceptions: what moves is frozen, the host is told, and nothing starts before it is cleared."""

import cases
from app_rig import connected, ends_of, start, state


def case_fault_stays_until_cleared():
    app, host = connected()
    start(host)
    app.controller.engine.advance(1)
    app.controller.engine.fault, app.controller.engine.fault_joint, app.controller.engine.moving = (
        42,
        1,
        False,
    )
    assert state(host) == "fault"
    assert ends_of(host)[-1] == ("fault", (1, 42, 1, 8400000))
    assert start(host) == ("error", "fault_pending", 1, 42)
    assert host.ask("home", (3,), bytes(8)) == ("error", "fault_pending", 1, 42)
    assert host.ask("clear")[0] == "ok"
    assert state(host) == "idle"
    assert start(host)[0] == "ok"
    assert len(ends_of(host)) == 1


def case_exception_becomes_a_fault():
    app, host = connected()
    start(host)
    app.controller.engine.explode = ValueError("deliberate")
    host.turn()
    assert state(host) == "fault"
    kinds = [kind for kind, _ in ends_of(host)]
    assert sorted(kinds) == ["fault", "notice"]
    assert "deliberate" in next(rest for kind, _, rest in host.events if kind == "notice")
    assert host.ask("status")[1][1] == 44
    assert app.controller.engine.calls[-1] == "freeze"


def case_exception_in_a_command_becomes_a_fault():
    app, host = connected()
    app.controller.store().names = None
    assert host.ask("list", (0,)) is None
    assert state(host) == "fault"


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
    assert "freeze" not in app.controller.engine.calls
    start(host)
    app.controller.halt()
    assert app.controller.engine.calls[-1] == "freeze"
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
        assert app.controller.engine.calls[-1] == "freeze"
        return
    raise AssertionError("went on")


def case_watchdog_bite_is_reported():
    _, host = connected(homed=False, fault=45)
    assert host.ask("status")[1][1] == 45
    assert start(host) == ("error", "fault_pending", 255, 45)
    host.ask("clear")
    assert state(host) == "unhomed"


cases.run(globals())
