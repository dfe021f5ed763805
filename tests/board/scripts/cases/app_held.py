"""Held motions, which brake in silence; drivers off and on."""

# all cases: slow on CPython, not emulated

import sys

import cases
from app_rig import connected, ends_of, state
from armtempo_shared import armrecord, codes, limits, messages, wire

MARGIN_MS = 100  # more than a question and its answer take


def hold_one(flags=0):
    app, host = connected(flags=flags)
    crc = wire.record_crc(host.record)
    assert host.ask("start", (messages.START_HELD, crc), "feed")[0] == "ok"
    return app, host


def case_it_goes_on_while_the_host_says_hold():
    app, host = hold_one()
    for _ in range(20):
        host.turn(limits.HOLD_TIMEOUT_MS - MARGIN_MS)
        assert host.ask("hold") == ("ok", (), b"")
    assert app.controller.board.engine.calls[-1] == "start"
    assert state(host) == "moving"


def case_it_brakes_once_in_silence_and_ends_without_a_fault():
    app, host = hold_one()
    host.turn(limits.HOLD_TIMEOUT_MS - MARGIN_MS)
    assert app.controller.board.engine.calls[-1] == "start"
    host.turn(2 * MARGIN_MS)
    assert app.controller.board.engine.calls[-1] == "brake"
    calls = len(app.controller.board.engine.calls)
    host.turn(1000)
    assert host.ask("hold") == ("ok", (), b"")  # too late: it continues braking
    host.turn(1000)
    assert len(app.controller.board.engine.calls) == calls
    assert state(host) == "braking"
    app.controller.board.engine.finish()
    assert state(host) == "idle"
    assert ends_of(host)[-1][0] == "done"
    assert host.ask("hold") == ("error", "not_moving", messages.NO_JOINT, 0)


def case_other_commands_do_not_hold_it():
    app, host = hold_one()
    for _ in range(10):
        host.turn(limits.HOLD_TIMEOUT_MS // 4)
        host.ask("samples", (0, 0))
    assert app.controller.board.engine.calls[-1] == "brake"


def case_the_next_run_is_not_held():
    app, host = hold_one()
    app.controller.board.engine.finish()
    host.turn(10)
    crc = wire.record_crc(host.record)
    assert host.ask("start", (0, crc), "feed")[0] == "ok"
    host.turn(10 * limits.HOLD_TIMEOUT_MS)
    assert app.controller.board.engine.calls[-1] == "start"
    assert host.ask("hold") == ("ok", (), b"")
    host.turn(10 * limits.HOLD_TIMEOUT_MS)
    assert app.controller.board.engine.calls[-1] == "start"


def case_a_stop_comes_before_the_silence():
    app, host = hold_one()
    host.ask("stop", (0,))
    host.turn(2 * limits.HOLD_TIMEOUT_MS)
    assert app.controller.board.engine.calls.count("brake") == 1


def case_a_lost_link_may_also_be_a_fault():
    """What the arm file says of it holds too: 200 ms here."""
    app, host = hold_one(armrecord.FLAG_STOP_ON_LINK_LOSS)
    host.turn(limits.HOLD_TIMEOUT_MS + MARGIN_MS)
    host.turn(1)
    assert app.controller.board.engine.calls.count("brake") == 1
    assert app.controller.board.fault() == codes.LINK_LOST


def case_hold_allocates_nothing():  # emulated
    if sys.implementation.name != "micropython":
        return
    import micropython

    app, _ = hold_one()
    app.controller.service(0)
    micropython.heap_lock()
    try:
        app.controller.hold()
        app.commands.hold((), 0)
        app.controller.service(0)
    finally:
        micropython.heap_unlock()


def case_drivers_off_loses_the_position_and_on_does_not_bring_it_back():
    app, host = connected()
    assert host.ask("drivers", (0,)) == ("ok", (), b"")
    assert app.controller.board.engine.calls[-1] == "off"
    assert state(host) == "unhomed"
    assert host.ask("drivers", (1,)) == ("ok", (), b"")
    assert app.controller.board.engine.calls[-1] == "on"
    assert state(host) == "unhomed"
    assert host.ask("home", (3,), bytes(8))[0] == "ok"
    assert state(host) == "idle"


def case_drivers_are_left_alone_while_it_moves_and_in_a_fault():
    app, host = hold_one()
    assert host.ask("drivers", (0,)) == ("error", "busy", messages.NO_JOINT, 0)
    app.controller.board.engine.finish()
    app.controller.board.engine.fault = codes.ESTOP
    host.turn(10)
    assert host.ask("drivers", (0,))[1] == "fault_pending"
    assert "off" not in app.controller.board.engine.calls


cases.run(globals())
