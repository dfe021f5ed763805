"""A motion under way: stopping it, its samples, and hosts that stall, change or are gone."""

# all cases: slow on CPython

import gc

import cases
import stand_in
from app_rig import App, connected, ends_of, flash, samples_of, start, state
from armtempo_shared import armrecord, messages, motion, wire


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
    stiff = motion.pack(5, [[0] * 8] * 2, [[0] * 8] * 2, 1, motion.NO_RAMPS, crc)
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
    host.port.room = 0
    app.controller.board.engine.advance(places + 20)
    host.turn()
    host.port.room = 1 << 30
    assert host.ask("samples", (0, 0)) == ("ok", (21, places), b"")
    app.controller.board.engine.finish()
    for _ in range(10):
        host.ask("status")
    got = samples_of(host)
    queued = got.index(got[-1] - places + 1)  # what had been queued before the host stalled
    assert got[queued:] == list(range(21, 21 + places))
    assert host.ask("status")[1][8:10] == (places, 21)
    assert ends_of(host)[-1] == (
        "done",
        (1, 8400000 * (places + 20), 8400000 * (places + 20), places + 21, 21),
    )


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
    host.port.room = 0
    for _ in range(300):
        host.send("status")
        app.controller.board.engine.advance(1)
        host.turn(1)
    assert app.controller.board.samples.next == 301
    assert app.controller.board.fault() == 0
    host.port.inbox = bytearray()
    host.port.room = 1 << 30
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


cases.run(globals())
