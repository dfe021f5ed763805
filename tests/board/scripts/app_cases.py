"""Cases of the program above the engine; each function asserts, its name is printed when it holds."""

import sys

import stand_in

stand_in.install()

from armtempo_board.app import App  # noqa: E402
from armtempo_shared import armrecord, messages, motion, wire  # noqa: E402

ROOT = sys.argv[1]
COUNT = [0]


def connected(flags=0, homed=True, fault=0):
    """A configured board with "feed" stored, greeted, and its host."""
    COUNT[0] += 1
    port = stand_in.Port()
    app = App(port, ROOT + str(COUNT[0]), 0, fault)
    host = stand_in.Host(app, port)
    assert host.hello()[0] == "ok"
    arm = stand_in.arm(flags=flags)
    assert host.upload("/arm", arm)[-1][0] == "ok"
    host.record = stand_in.record(arm)
    assert host.upload("feed", host.record)[-1][0] == "ok"
    if homed:
        assert host.ask("home", (3,), bytes(8))[0] == "ok"
    return app, host


def start(host):
    return host.ask("start", (0, wire.record_crc(host.record)), "feed")


def state(host):
    return wire.STATES[host.ask("status")[1][0]]


def samples_of(host):
    return [fields[1] for kind, fields, _ in host.events if kind == "sample"]


def ends_of(host):
    return [(kind, fields) for kind, fields, _ in host.events if kind != "sample"]


def case_repeated_command_acts_once():
    app, host = connected()
    sequence = host.send("home", (1,), bytes(8))
    host.send("home", (1,), bytes(8), sequence)
    answers = host.turn()
    host.send("home", (1,), bytes(8), sequence)
    answers += host.turn()
    assert app.engine.calls.count("home") == 2  # one was the connecting
    assert len(answers) == 3
    assert answers[0] == answers[1] == answers[2]


def case_same_number_other_content_is_another_command():
    app, host = connected()
    sequence = host.send("home", (1,), bytes(8))
    host.turn()
    host.send("home", (2,), bytes(8), sequence)
    host.turn()
    assert app.engine.calls.count("home") == 3


def case_repeated_start_answers_again():
    app, host = connected()
    sequence = host.send("start", (0, wire.record_crc(host.record)), "feed")
    first = host.turn()
    host.send("start", (0, wire.record_crc(host.record)), "feed", sequence)
    second = host.turn()
    assert app.engine.calls.count("start") == 1
    assert [frame for frame in first if frame[1] == 0x7E] == second


def case_commands_before_hello_are_refused():
    app = App(stand_in.Port(), ROOT + "nobody")
    host = stand_in.Host(app, app.link.stream)
    for name, values in (("status", ()), ("clear", ()), ("stop", (1,)), ("list", (0,)), ("leave", ())):
        assert host.ask(name, values) == ("error", "no_session", 255, 0)
    assert host.ask("hello", (99, 1)) == ("error", "protocol", 255, wire.PROTOCOL_VERSION)
    assert host.ask("status") == ("error", "no_session", 255, 0)
    assert host.hello()[0] == "ok"
    assert state(host) == "unconfigured"


def case_wrong_lengths_are_malformed():
    _, host = connected()
    for name, payload in (("status", b"x"), ("put_data", b"\0\0\0"), ("home", b""), ("samples", bytes(7))):
        host.sequence += 1
        host.port.inbox.extend(wire.frame(host.sequence, wire.COMMAND[name][1], payload))
        reply = host.turn()[-1]
        assert wire.decode(wire.EVENT["error"], reply[2])[0][1] == wire.ERROR_CODES["malformed"], name
    host.port.inbox.extend(wire.frame(9, 0x99, b""))
    assert wire.decode(wire.EVENT["error"], host.turn()[-1][2])[0][1] == wire.ERROR_CODES["unknown_command"]
    assert host.ask("home", (3,), bytes(4)) == ("error", "malformed", 255, 0)
    assert host.ask("home", (4,), bytes(8)) == ("error", "malformed", 255, 0)
    assert host.ask("remove", (), b"\xff\xfe") == ("error", "malformed", 255, 0)


def case_upload_out_of_order():
    _, host = connected()
    record = host.record
    assert host.ask("put_data", (0,), b"x") == ("error", "bad_offset", 255, 0)
    assert host.ask("put_begin", (len(record), wire.record_crc(record)), "two")[0] == "ok"
    assert host.ask("put_data", (0,), record[:50]) == ("ok", (50,), b"")
    assert host.ask("put_data", (60,), record[60:70]) == ("error", "bad_offset", 255, 50)
    assert host.ask("put_data", (0,), record[:20]) == ("ok", (50,), b"")
    assert host.ask("put_data", (40,), record[40:100]) == ("ok", (100,), b"")
    assert host.ask("put_commit", (wire.record_crc(record),)) == ("error", "bad_offset", 255, 100)
    assert host.ask("put_data", (100,), record[100:]) == ("ok", (len(record),), b"")
    assert host.ask("put_data", (len(record),), b"x") == ("error", "bad_offset", 255, len(record))
    assert host.ask("put_commit", (wire.record_crc(record),)) == ("ok", (), b"")
    assert host.ask("put_commit", (wire.record_crc(record),))[1] == "bad_offset"


def case_damaged_uploads_are_refused():
    _, host = connected()
    wrong = bytearray(host.record)
    wrong[30] ^= 1
    assert host.upload("feed", bytes(wrong))[-1] == ("error", "bad_checksum", 255, 0)
    assert host.upload("feed", wire.frame(0, 0, b"no record")[1:])[-1] == ("error", "bad_record", 255, 0)
    assert host.upload("/arm", host.record)[-1] == ("error", "bad_record", 255, 0)
    assert host.ask("list", (0,))[1][2] == wire.record_crc(host.record)
    assert host.ask("put_begin", (1 << 20, 0), "big")[:2] == ("error", "too_long")
    for name in ("", "a b", "../x", "x" * 25, "é", "/arm2"):
        assert host.ask("put_begin", (10, 0), name) == ("error", "bad_name", 255, 0), name
    assert host.ask("put_begin", (10, 0), "Feed") == ("error", "exists", 255, 0)


def case_names():
    _, host = connected()
    assert host.upload("apple", host.record)[-1][0] == "ok"
    assert host.ask("set_default", (), "feed")[0] == "ok"
    assert host.ask("rename", (4,), "feedapple") == ("error", "exists", 255, 0)
    assert host.ask("rename", (4,), "feedfood") == ("ok", (), b"")
    assert [host.ask("list", (i,))[2] for i in range(2)] == ["apple", "food"]
    assert [host.ask("list", (i,))[1][5] for i in range(2)] == [0, 1]
    assert host.ask("remove", (), "feed") == ("error", "not_found", 255, 0)
    assert host.ask("remove", (), "food") == ("ok", (), b"")
    assert host.ask("set_default", (), "food") == ("error", "not_found", 255, 0)
    assert host.ask("set_default", (), "") == ("ok", (), b"")
    data = b""
    while len(data) < len(host.record):
        data += host.ask("get", (len(data), 90), "apple")[2]
    assert data == host.record
    assert host.ask("get", (0, 999), "/arm")[2] == stand_in.arm()
    assert host.ask("get", (0, 9), "food") == ("error", "not_found", 255, 0)


def case_start_only_when_everything_is_valid():
    app, host = connected(homed=False)
    assert start(host) == ("error", "unhomed", 0, 0)
    assert host.ask("home", (3,), b"\xff\xff\xff\x7f" + bytes(4)) == ("error", "out_of_range", 0, 0x7FFFFFFF)
    assert host.ask("home", (1,), bytes(8))[0] == "ok"
    assert start(host) == ("error", "unhomed", 1, 0)
    assert host.ask("home", (2,), bytes(8))[0] == "ok"
    assert host.ask("start", (0, 1), "feed") == ("error", "bad_checksum", 255, 0)
    assert host.ask("start", (0, 1), "fee") == ("error", "not_found", 255, 0)
    other = stand_in.record(stand_in.arm(low=5))
    host.upload("other", other)
    assert host.ask("start", (0, wire.record_crc(other)), "other") == ("error", "arm_mismatch", 255, 0)
    three = stand_in.record(stand_in.arm(), joints=3)
    host.upload("three", three)
    assert host.ask("start", (0, wire.record_crc(three)), "three") == ("error", "wrong_joints", 255, 3)
    app.engine.refusal = (21, 1, 5)
    assert start(host) == ("error", "too_fast", 1, 5)
    assert app.engine.calls.count("start") == 0
    app.engine.refusal = None
    assert start(host) == ("ok", (1, 84000), b"")


def case_damaged_file_in_flash_is_not_run():
    app, host = connected()
    name = ROOT + str(COUNT[0]) + "/feed.atm"
    with open(name, "rb") as file:
        data = bytearray(file.read())
    data[40] ^= 4
    with open(name, "wb") as file:
        file.write(data)
    assert start(host) == ("error", "bad_record", 255, 0)
    assert host.ask("list", (0,)) == ("ok", (1, len(data), 0, 0, 0, 0), "feed")
    assert app.engine.calls.count("load") == 0


def case_only_a_few_commands_while_moving():
    app, host = connected()
    start(host)
    assert state(host) == "moving"
    for name, _, _, fields, _ in wire.COMMAND.values():
        if name != "stop":
            answer = host.ask(name, [1] * len(fields), b"")
            busy = name not in ("hello", "status", "samples")
            assert (answer[:2] == ("error", "busy")) == busy, (name, answer)
    assert app.engine.calls[-1] == "start"


def case_stop_brakes_or_freezes():
    app, host = connected()
    assert host.ask("stop", (0,)) == ("error", "not_moving", 255, 0)
    start(host)
    assert host.ask("stop", (0,)) == ("ok", (), b"")
    assert state(host) == "braking"
    app.engine.advance(1)
    assert host.turn()[-1][2][16] == messages.SAMPLE_BRAKING
    app.engine.finish()
    assert state(host) == "idle"
    assert ends_of(host)[-1][0] == "done"
    start(host)
    host.ask("stop", (1,))
    assert app.engine.calls[-1] == "freeze"


def case_stop_freezes_what_cannot_brake():
    app, host = connected()
    crc = armrecord.unpack(stand_in.arm())[2]
    stiff = motion.pack(5, [[0] * 8] * 2, [[0] * 8] * 2, 3, 1, 0, crc)
    host.upload("stiff", stiff)
    host.ask("start", (0, wire.record_crc(stiff)), "stiff")
    host.ask("stop", (0,))
    assert app.engine.calls[-1] == "freeze"


def case_samples_are_kept_until_acknowledged():
    app, host = connected()
    start(host)
    app.engine.advance(9)
    host.turn()
    assert host.ask("samples", (0, 0)) == ("ok", (0, 10), b"")
    assert samples_of(host) == list(range(10))
    assert host.ask("samples", (4, 3)) == ("ok", (4, 6), b"")
    assert samples_of(host)[10:] == [4, 5, 6]
    assert host.ask("samples", (2, 3)) == ("ok", (4, 6), b"")
    assert samples_of(host)[13:] == [4]
    assert host.ask("samples", (99, 0)) == ("ok", (10, 0), b"")


def case_oldest_sample_gives_way_and_is_counted():
    app, host = connected()
    start(host)
    places = app.samples._places
    host.port.room = 0
    app.engine.advance(places + 20)
    host.turn()
    host.port.room = 1 << 30
    assert host.ask("samples", (0, 0)) == ("ok", (21, places), b"")
    app.engine.finish()
    for _ in range(10):
        host.ask("status")
    got = samples_of(host)
    queued = got.index(got[-1] - places + 1)  # what had been queued before the host stalled
    assert got[queued:] == list(range(21, 21 + places))
    assert host.ask("status")[1][6:8] == (places, 21)
    assert ends_of(host)[-1] == ("done", (1, 8400000 * (places + 20), places + 21, 21))


def case_stalled_host_does_not_stall_the_loop():
    app, host = connected()
    start(host)
    host.port.room = 0
    for _ in range(300):
        host.send("status")
        app.engine.advance(1)
        host.turn(1)
    assert app.samples.next == 301
    assert app.fault() == 0
    host.port.inbox = bytearray()
    host.port.room = 1 << 30
    host.turn()
    assert state(host) == "moving"


def case_a_new_host_picks_the_run_up():
    app, host = connected()
    start(host)
    app.engine.advance(5)
    host.turn()
    host.ask("samples", (2, 0))
    other = stand_in.Host(app, host.port)
    assert other.hello(session=2)[1][3] == wire.STATES.index("moving")
    app.engine.advance(1)
    assert other.ask("status")[1][4] == 1
    first, count = other.ask("samples", (0, 0))[1]
    assert (first, count) == (2, 5)
    other.ask("samples", (first, count))
    assert sorted(samples_of(other)) == [2, 3, 4, 5, 6, 6]


def case_fault_stays_until_cleared():
    app, host = connected()
    start(host)
    app.engine.advance(1)
    app.engine.fault, app.engine.fault_joint, app.engine.moving = 42, 1, False
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
    app.engine.explode = ValueError("deliberate")
    host.turn()
    assert state(host) == "fault"
    kinds = [kind for kind, _ in ends_of(host)]
    assert sorted(kinds) == ["fault", "notice"]
    assert "deliberate" in next(rest for kind, _, rest in host.events if kind == "notice")
    assert host.ask("status")[1][1] == 44
    assert app.engine.calls[-1] == "freeze"


def case_exception_in_a_command_becomes_a_fault():
    app, host = connected()
    app.store().names = None
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
    app.halt()
    assert "freeze" not in app.engine.calls
    start(host)
    app.halt()
    assert app.engine.calls[-1] == "freeze"
    assert not app.moving()


class Failing:
    def show(self, state):
        raise ValueError("deliberate")


def case_a_failing_led_freezes_what_moves():
    from armtempo_board import program

    app, host = connected()
    start(host)
    program.app = app
    try:
        program.run(Failing(), None, None)
    except ValueError:
        assert app.engine.calls[-1] == "freeze"
        return
    raise AssertionError("went on")


def case_watchdog_bite_is_reported():
    _, host = connected(homed=False, fault=45)
    assert host.ask("status")[1][1] == 45
    assert start(host) == ("error", "fault_pending", 255, 45)
    host.ask("clear")
    assert state(host) == "unhomed"


def case_lost_host_stops_the_motion_if_the_arm_says_so():
    app, host = connected(flags=armrecord.FLAG_STOP_ON_LINK_LOSS)
    start(host)
    for _ in range(5):
        host.turn(100)
        host.ask("samples", (0, 0))
    assert app.state() == wire.STATES.index("moving")
    host.turn(300)
    assert app.engine.calls[-1] == "brake"
    assert app.state() == wire.STATES.index("braking")
    app.engine.finish()
    assert host.ask("status")[1][:2] == (wire.STATES.index("fault"), 46)


def case_lost_host_leaves_the_motion_otherwise():
    app, host = connected()
    start(host)
    host.turn(2000)
    assert app.engine.calls[-1] == "start"


def case_samples_of_a_run_without_host_are_kept():
    _, host = connected()
    host.ask("set_default", (), "feed")
    again = App(host.port, ROOT + str(COUNT[0]))
    again.engine.home(3, [0, 0])
    again.begin(again.store().default(), 0)
    host = stand_in.Host(again, host.port)
    host.turn()
    again.engine.advance(4)
    again.engine.finish()
    host.turn()
    assert not host.port.outbox
    host.hello()
    assert samples_of(host) == []
    assert host.ask("status")[1][4] == 1
    assert host.ask("samples", (0, 0)) == ("ok", (0, 5), b"")
    host.ask("samples", (0, 5))
    assert samples_of(host) == [0, 1, 2, 3, 4]


def case_half_a_frame_does_not_block_for_long():
    _, host = connected()
    host.port.inbox.extend(wire.frame(7, 2, bytes(300))[:100])
    host.turn(100)
    assert state(host) == "idle"
    bad = host.ask("status")[1][8]
    assert bad >= 1


def case_repl_is_reached_by_ctrl_c_when_idle_only():
    app, host = connected()
    start(host)
    host.turn(1000)
    host.port.inbox.extend(b"\r\x03\r\x01")
    host.turn(1000)
    assert not app.left()
    app.engine.finish()
    host.turn(1000)
    assert not app.left()
    host.port.inbox.extend(b"\r\x03\r\x01")
    for _ in range(10):
        if not app.left():
            host.turn(1)
    assert app.left()
    assert bytes(host.port.inbox) == b"\x01"


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
    host.port.inbox.extend(b"\r\x03\r\x01")
    for _ in range(10):
        if not app.left():
            host.turn(1)
    assert app.left()
    assert bytes(host.port.inbox) == b"\x01"


def case_leave_answers_first():
    app, host = connected()
    assert host.ask("leave") == ("ok", (), b"")
    assert app.left()


for name in sorted(globals()):
    if name.startswith("case_"):
        globals()[name]()
        print(name)
