"""A motion under way: stopping it, its samples, hosts that stall, change or are gone; held ones; drivers off."""

# all cases: slow on CPython

import gc
import sys

import cases
import stand_in
from app_rig import App, connected, ends_of, flash, samples_of, start, state
from armtempo_shared import armrecord, codes, limits, messages, motion, wire

MARGIN_MS = 100  # more than a question and its answer take


def case_stop_brakes_or_freezes():
    app, host = connected()
    assert host.ask("stop", (0,)) == ("error", "not_moving", 255, 0)
    start(host)
    assert host.ask("stop", (0,)) == ("ok", (), b"")
    assert state(host) == "braking"
    app.controller.board.engine.advance(1)
    assert host.turn()[-1][2][24] == messages.SAMPLE_BRAKING
    app.controller.board.engine.finish()
    assert state(host) == "idle"
    assert ends_of(host)[-1][0] == "done"
    start(host)
    host.ask("stop", (1,))
    assert app.controller.board.engine.calls[-1] == "freeze"


def case_speed_of_what_moves_and_of_the_next_start():
    app, host = connected()
    assert host.ask("speed", (0,)) == ("error", "not_moving", 255, 0)
    for wrong in (1, 9, 1001, 0xFFFE):
        assert host.ask("speed", (wrong,)) == ("error", "malformed", 255, 0)
    assert host.ask("speed", (500,)) == ("ok", (), b"")
    assert host.ask("status")[1][7] == 500
    start(host)
    engine = app.controller.board.engine
    assert engine.rates.wanted == 500
    for rate in (10, 0, messages.RESUME, 1000):
        assert host.ask("speed", (rate,)) == ("ok", (), b"")
        assert engine.rates.wanted == rate
    engine.finish()
    start(host)
    assert engine.rates.wanted == 1000
    engine.finish()
    host.ask("speed", (500,))
    other = stand_in.Host(app, host.port)
    other.ask("hello", (wire.PROTOCOL_VERSION, 99))
    other.record = host.record
    start(other)
    assert engine.rates.wanted == 1000


def case_stop_freezes_what_cannot_brake():
    app, host = connected()
    crc = armrecord.unpack(stand_in.arm())[2]
    stiff = motion.pack(5, [[0] * 8] * 2, [[0] * 8] * 2, 1, motion.no_ramps(), crc)
    host.upload("stiff", stiff)
    host.ask("start", (0, wire.record_crc(stiff)), "stiff")
    host.ask("stop", (0,))
    assert app.controller.board.engine.calls[-1] == "freeze"


def case_samples_are_kept_until_acknowledged():
    app, host = connected()
    start(host)
    app.controller.board.engine.advance(9)
    host.turn()
    assert host.ask("samples", (0, 0)) == ("ok", (0, 10), b"")
    assert samples_of(host) == list(range(10))
    assert host.ask("samples", (4, 3)) == ("ok", (4, 6), b"")
    assert samples_of(host)[10:] == [4, 5, 6]
    assert host.ask("samples", (2, 3)) == ("ok", (4, 6), b"")
    assert samples_of(host)[13:] == [4]
    assert host.ask("samples", (99, 0)) == ("ok", (10, 0), b"")


def case_the_next_run_counts_its_samples_from_0():
    app, host = connected()
    for _ in range(2):
        host.events.clear()
        start(host)
        app.controller.board.engine.advance(3)
        host.turn()
        assert samples_of(host) == [0, 1, 2, 3]
        assert host.ask("samples", (0, 0)) == ("ok", (0, 4), b"")
        app.controller.board.engine.finish()
        host.turn()


def case_oldest_sample_gives_way_and_is_counted():
    app, host = connected()
    start(host)
    places = app.controller.board.samples._capacity
    host.port.space = 0
    app.controller.board.engine.advance(places + 20)
    host.turn()
    host.port.space = 1 << 30
    assert host.ask("samples", (0, 0)) == ("ok", (21, places), b"")
    app.controller.board.engine.finish()
    for _ in range(10):
        host.ask("status")
    got = samples_of(host)
    queued = got.index(got[-1] - places + 1)  # what had been queued before the host stalled
    assert got[queued:] == list(range(21, 21 + places))
    lost = 21 - queued
    assert host.ask("status")[1][8:10] == (places, lost)
    assert ends_of(host)[-1] == (
        "done",
        (1, 8400000 * (places + 20), 8400000 * (places + 20), places + 21, lost),
    )


def case_what_the_host_has_is_not_lost_though_it_acknowledges_nothing():
    app, host = connected()
    start(host)
    places = app.controller.board.samples._capacity
    for _ in range(places + 20):
        app.controller.board.engine.advance(1)
        host.turn()
    app.controller.board.engine.finish()
    host.turn()
    assert samples_of(host) == list(range(places + 21))
    assert host.ask("status")[1][8:10] == (places, 0)


def case_samples_of_a_run_without_host_are_kept():
    _, host = connected()
    host.ask("set_default", (), "feed")
    again = App(host.port, flash())
    again.controller.board.engine.home(3, [0, 0])
    again.controller.begin(again.controller.board.store().default(), 0)
    host = stand_in.Host(again, host.port)
    host.turn()
    again.controller.board.engine.advance(4)
    again.controller.board.engine.finish()
    host.turn()
    assert not host.port.outbox
    host.hello()
    assert samples_of(host) == []
    assert host.ask("status")[1][4] == 1
    assert host.ask("samples", (0, 0)) == ("ok", (0, 5), b"")
    host.ask("samples", (0, 5))
    assert samples_of(host) == [0, 1, 2, 3, 4]


def case_stalled_host_does_not_stall_the_loop():
    app, host = connected()
    start(host)
    host.port.space = 0
    for _ in range(300):
        host.send("status")
        app.controller.board.engine.advance(1)
        host.turn(1)
    assert app.controller.board.samples.next == 301
    assert app.controller.board.fault() == 0
    host.port.inbox = bytearray()
    host.port.space = 1 << 30
    host.turn()
    assert state(host) == "moving"


def case_a_new_host_picks_the_run_up():
    app, host = connected()
    start(host)
    app.controller.board.engine.advance(5)
    host.turn()
    host.ask("samples", (2, 0))
    other = stand_in.Host(app, host.port)
    assert other.hello(session=2)[1][3] == wire.STATES.index("moving")
    app.controller.board.engine.advance(1)
    assert other.ask("status")[1][4] == 1
    first, count = other.ask("samples", (0, 0))[1]
    assert (first, count) == (2, 5)
    other.ask("samples", (first, count))
    assert sorted(samples_of(other)) == [2, 3, 4, 5, 6, 6]


def case_lost_host_stops_the_motion_if_the_arm_says_so():
    app, host = connected(flags=armrecord.FLAG_STOP_ON_LINK_LOSS)
    start(host)
    for _ in range(5):
        host.turn(100)
        host.ask("samples", (0, 0))
    assert app.controller.state() == wire.STATES.index("moving")
    host.turn(300)
    assert app.controller.board.engine.calls[-1] == "brake"
    assert app.controller.state() == wire.STATES.index("braking")
    app.controller.board.engine.finish()
    assert host.ask("status")[1][:2] == (wire.STATES.index("fault"), 46)


def case_lost_host_leaves_the_motion_otherwise():
    app, host = connected()
    start(host)
    host.turn(2000)
    assert app.controller.board.engine.calls[-1] == "start"


def case_the_heap_is_collected_often_but_while_something_moves():
    """What calls allocate counts, so that a collection would come every few turns of a motion."""
    if not hasattr(gc, "threshold"):
        return
    app, host = connected()
    for _ in range(2):
        start(host)
        assert gc.threshold() == -1
        host.turn(1000)
        assert gc.threshold() == -1
        app.controller.board.engine.finish()
        host.turn(10)
        assert 0 < gc.threshold() < (gc.mem_alloc() + gc.mem_free()) // 60


def case_a_homing_start_names_whose_switches_end_it():
    app, host = connected()
    crc = wire.record_crc(host.record)
    engine = app.controller.board.engine
    for mask, seeks, watched in (
        (0, 0, 0b11),  # of both joints, which move
        (0b10, 0, 0b10),
        (0, messages.START_SEEKS, 0b11),
        (0b10, messages.START_SEEKS, 0b10),
    ):
        flags = messages.START_HOMING | mask << messages.START_SWITCHES_BIT | seeks
        assert host.ask("start", (flags, crc), "feed")[0] == "ok"
        assert (engine.homing, engine.seeks) == (watched, seeks != 0)
        engine.finish()
        host.turn(10)


def hold_one(flags=0):
    app, host = connected(flags=flags)
    crc = wire.record_crc(host.record)
    assert host.ask("start", (messages.START_HELD, crc), "feed")[0] == "ok"
    return app, host


def case_it_goes_on_while_the_host_says_hold():  # not emulated
    app, host = hold_one()
    for _ in range(20):
        host.turn(limits.HOLD_TIMEOUT_MS - MARGIN_MS)
        assert host.ask("hold") == ("ok", (), b"")
    assert app.controller.board.engine.calls[-1] == "start"
    assert state(host) == "moving"


def case_it_brakes_once_in_silence_and_ends_without_a_fault():  # not emulated
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


def case_other_commands_do_not_hold_it():  # not emulated
    app, host = hold_one()
    for _ in range(10):
        host.turn(limits.HOLD_TIMEOUT_MS // 4)
        host.ask("samples", (0, 0))
    assert app.controller.board.engine.calls[-1] == "brake"


def case_the_next_run_is_not_held():  # not emulated
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


def case_a_stop_comes_before_the_silence():  # not emulated
    app, host = hold_one()
    host.ask("stop", (0,))
    host.turn(2 * limits.HOLD_TIMEOUT_MS)
    assert app.controller.board.engine.calls.count("brake") == 1


def case_a_lost_link_may_also_be_a_fault():  # not emulated
    """What the arm file says of it holds too: 200 ms here."""
    app, host = hold_one(armrecord.FLAG_STOP_ON_LINK_LOSS)
    host.turn(limits.HOLD_TIMEOUT_MS + MARGIN_MS)
    host.turn(1)
    assert app.controller.board.engine.calls.count("brake") == 1
    assert app.controller.board.fault() == codes.LINK_LOST


def case_hold_allocates_nothing():
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


def case_drivers_off_loses_the_position_and_on_does_not_bring_it_back():  # not emulated
    app, host = connected()
    assert host.ask("drivers", (0,)) == ("ok", (), b"")
    assert app.controller.board.engine.calls[-1] == "off"
    assert state(host) == "unhomed"
    assert host.ask("drivers", (1,)) == ("ok", (), b"")
    assert app.controller.board.engine.calls[-1] == "on"
    assert state(host) == "unhomed"
    assert host.ask("home", (3,), bytes(8))[0] == "ok"
    assert state(host) == "idle"


def case_drivers_are_left_alone_while_it_moves_and_in_a_fault():  # not emulated
    app, host = hold_one()
    assert host.ask("drivers", (0,)) == ("error", "busy", messages.NO_JOINT, 0)
    app.controller.board.engine.finish()
    app.controller.board.engine.fault = codes.ESTOP
    host.turn(10)
    assert host.ask("drivers", (0,))[1] == "fault_pending"
    assert "off" not in app.controller.board.engine.calls


cases.run(globals())
