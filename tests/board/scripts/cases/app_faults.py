"""Faults and exceptions freeze what moves and make the outputs safe; outputs and inputs otherwise."""

# all cases: slow on CPython

import cases
import stand_in

from app_rig import App, connected, ends_of, flash, start, state  # isort: skip  it puts the stand-ins into place

from armtempo_board.app import app as app_module
from armtempo_shared import armrecord, codes, wire
from pin_rows import GRIPPER, PART, PUMP


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


DOOR = {"pin": 0x32, "active_high": 1, "debounce_ms": 0}
SAFE = {"D0": 1, "B8": 2333}
DOWN = {"D1": 1, "D2": 0}


def wired():
    """A board whose arm has two outputs and two inputs, none of which is active."""
    stand_in.Pin.levels.update(DOWN)
    return connected(outputs=(PUMP, GRIPPER), inputs=(PART, DOOR))


def levels():
    return {pin: stand_in.Pin.levels[pin] for pin in SAFE}


def case_safe_from_the_start():  # not emulated
    _, host = wired()
    assert levels() == SAFE
    assert stand_in.Timer.made == {10: (51, 64614)}
    assert host.ask("inputs") == ("ok", (0,), b"\x00\x00" + (7282).to_bytes(2, "little"))


def case_an_arm_that_was_stored_gets_them_at_the_start():  # not emulated
    wired()
    stand_in.Pin.levels.clear()
    stand_in.Pin.levels.update(DOWN)
    app = App(stand_in.Port(), flash())
    assert levels() == SAFE
    assert app.controller.board.outputs.values[1] == 7282


def case_set_while_moving():  # not emulated
    _, host = wired()
    start(host)
    assert state(host) == "moving"
    assert host.ask("output", (0, 65535)) == ("ok", (), b"")
    assert host.ask("output", (1, 65535)) == ("ok", (), b"")
    assert levels() == {"D0": 0, "B8": 8077}
    assert host.ask("output", (1, 0))[0] == "ok"
    assert levels()["B8"] == 1615
    assert host.ask("output", (1, 32768))[0] == "ok"
    assert abs(levels()["B8"] - 4846) <= 1
    assert host.ask("inputs")[2] == b"\xff\xff\x00\x80"
    assert state(host) == "moving"


def case_unknown_output_is_refused():  # not emulated
    _, host = wired()
    assert host.ask("output", (2, 0)) == ("error", "no_output", 255, 0)
    assert levels() == SAFE


def open_and_pump(host):
    assert host.ask("output", (0, 65535))[0] == "ok"
    assert host.ask("output", (1, 65535))[0] == "ok"
    assert levels() == {"D0": 0, "B8": 8077}


def case_fault_makes_safe_until_it_is_cleared():  # not emulated
    for code in (40, 42, 45):
        app, host = wired()
        start(host)
        open_and_pump(host)
        app.controller.board.engine.fault = code
        app.controller.board.engine.moving = False
        host.turn(1)
        assert levels() == SAFE, code
        assert host.ask("output", (0, 65535)) == ("error", "fault_pending", 255, 0)
        assert levels() == SAFE
        assert host.ask("clear")[0] == "ok"
        assert levels() == SAFE
        open_and_pump(host)


def case_exception_makes_safe():  # not emulated
    app, host = wired()
    open_and_pump(host)
    app.controller.board.engine.explode = ValueError("deliberate")
    host.turn(1)
    assert levels() == SAFE


def case_the_end_of_the_program_makes_safe():  # not emulated
    app, host = wired()
    open_and_pump(host)
    app.controller.halt()
    assert levels() == SAFE


def case_another_arm_lets_go_of_them():  # not emulated
    app, host = wired()
    open_and_pump(host)
    assert host.upload("/arm", stand_in.arm())[-1][0] == "ok"
    assert "D0" not in stand_in.Pin.levels and "B8" not in stand_in.Pin.levels
    assert stand_in.Timer.made == {}
    assert host.ask("inputs") == ("error", "unknown_command", 255, 0)
    assert app.controller.board.outputs is None and app.controller.board.inputs is None
    assert host.upload("/arm", stand_in.arm(outputs=(PUMP,)))[-1][0] == "ok"
    assert host.ask("inputs") == ("ok", (0,), b"\x00\x00")


def case_the_same_arm_with_other_outputs_stays_where_it_is():  # not emulated
    app, host = wired()
    app.controller.board.engine.steps = [5, 6]
    assert host.upload("/arm", stand_in.arm(outputs=(PUMP,)))[-1][0] == "ok"
    assert (app.controller.board.known(), app.controller.board.engine.steps) == (3, [5, 6])


def case_a_level_counts_when_it_is_steady():  # not emulated
    app, host = wired()
    inputs = app.controller.board.inputs
    stand_in.Pin.levels.update(D1=0, D2=1)
    host.turn(1)
    for _ in range(8):
        assert (inputs.level(0), inputs.level(1)) == (0, 1)
        host.turn(1)
    stand_in.Pin.levels["D1"] = 1  # a bounce: the time begins again
    host.turn(1)
    stand_in.Pin.levels["D1"] = 0
    host.turn(9)
    assert inputs.level(0) == 0
    host.turn(2)
    assert inputs.level(0) == 1
    assert host.ask("inputs")[1] == (3,)
    stand_in.Pin.levels["D1"] = 1
    host.turn(20)
    assert inputs.level(0) == 0


def case_debounced_while_moving():  # not emulated
    app, host = wired()
    start(host)
    stand_in.Pin.levels["D1"] = 0
    host.turn(20)
    assert app.controller.moving() and app.controller.board.inputs.level(0) == 1


def case_the_engines_pins_and_timers_are_refused():  # not emulated
    """STEP, DIR, ENABLE, LED, button, limit switch, encoder; timers of the steps and of an encoder; the same twice."""
    _, host = wired()
    crc = host.hello()[1][9]
    for pin in (0x0F, 0x47, 0x4C, 0x3C, 0x00, 0x39, 0x49, 0xF1):
        arm = stand_in.arm(inputs=(dict(PART, pin=pin),))
        assert host.upload("/arm", arm)[-1] == ("error", "pin_taken", 255, pin), pin
    for timer in (2, 5, 6, 1, 3, 15):
        arm = stand_in.arm(outputs=(dict(GRIPPER, timer=timer),))
        assert host.upload("/arm", arm)[-1] == ("error", "pin_taken", 255, 0x18), timer
    arm = stand_in.arm(outputs=(PUMP,), inputs=(dict(PART, pin=PUMP["pin"]),))
    assert host.upload("/arm", arm)[-1] == ("error", "pin_taken", 255, 0x30)
    assert host.hello()[1][9] == crc
    assert host.ask("inputs")[0] == "ok"


def case_a_record_of_another_version_is_refused():  # not emulated
    _, host = wired()
    data = bytearray(stand_in.arm(outputs=(PUMP,)))[:-4]
    data[4] = armrecord.VERSION_WITH_OUTPUTS + 1
    data = bytes(data)
    data += armrecord.crc32(data).to_bytes(4, "little")
    assert host.upload("/arm", data)[-1][:2] == ("error", "bad_record")
    assert host.ask("inputs")[0] == "ok"


cases.run(globals())
