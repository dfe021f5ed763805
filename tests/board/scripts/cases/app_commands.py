"""Commands to the program above the engine, which are refused, which a repetition; motions in its store."""

# all cases: slow on CPython

import gc
import os

import cases
import stand_in
from app_rig import ROOT, App, connected, flash, start, state
from armtempo_board.link.serial_link import SerialLink
from armtempo_board.storage import motion_file, store
from armtempo_shared import motion, table, wire


def case_repeated_command_acts_once():
    app, host = connected()
    sequence = host.send("home", (1,), bytes(8))
    host.send("home", (1,), bytes(8), sequence)
    answers = host.turn()
    host.send("home", (1,), bytes(8), sequence)
    answers += host.turn()
    assert app.controller.board.engine.calls.count("home") == 2  # one was the connecting
    assert len(answers) == 3
    assert answers[0] == answers[1] == answers[2]


def case_same_number_other_content_is_another_command():
    app, host = connected()
    sequence = host.send("home", (1,), bytes(8))
    host.turn()
    host.send("home", (2,), bytes(8), sequence)
    host.turn()
    assert app.controller.board.engine.calls.count("home") == 3


def case_repeated_start_answers_again():
    app, host = connected()
    sequence = host.send("start", (0, wire.record_crc(host.record)), "feed")
    first = host.turn()
    host.send("start", (0, wire.record_crc(host.record)), "feed", sequence)
    second = host.turn()
    assert app.controller.board.engine.calls.count("start") == 1
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


def case_a_new_session_hears_nothing_that_was_meant_for_the_old_one():
    app, host = connected()
    start(host)
    host.port.space = 0
    app.controller.board.engine.advance(3)
    host.turn()
    assert not app.link.idle()  # samples wait for a host that does not read
    host.events.clear()
    host.send("hello", (wire.PROTOCOL_VERSION, 2))
    host.turn()
    host.port.space = 1 << 30
    frames = [wire.EVENT_BY_ID[number][0] for _, number, _ in host.turn()]
    assert frames == ["ok"], frames


def case_without_an_arm_nothing_moves():
    app = App(stand_in.Port(), ROOT + "armless")
    host = stand_in.Host(app, app.link.stream)
    host.hello()
    for name, values, tail in (("start", (0, 1), "feed"), ("home", (1,), bytes(4)), ("drivers", (1,), b"")):
        assert host.ask(name, values, tail) == ("error", "unconfigured", 255, 0), name


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


def case_half_a_frame_does_not_block_for_long():
    _, host = connected()
    host.port.inbox.extend(wire.frame(7, 2, bytes(300))[:100])
    host.turn(100)
    assert state(host) == "idle"
    bad = host.ask("status")[1][10]
    assert bad >= 1


def case_a_frame_may_come_in_pieces():
    """With 40 ms between them: the pause counts from the last byte."""
    app, host = connected()
    frame = wire.frame(99, wire.COMMAND["home"][1], wire.encode(wire.COMMAND["home"], (1,), bytes(8)))
    for byte in frame:
        host.port.inbox.append(byte)
        answers = host.turn(40)
    assert [answer[0] for answer in answers] == [99]
    assert app.controller.board.engine.calls.count("home") == 2  # one was the connecting
    assert host.ask("status")[1][10] == 0


def case_what_the_port_took_makes_space():
    """A piece of an event is enough; what stays after it comes whole."""
    port = stand_in.Port()
    link = SerialLink(port)
    size = 250
    port.space = 200
    for number in range(3):
        while not link.has_space(size):
            assert number == 2
            assert port.space, "no space for the third, though there are bytes free"
            link.flush()
        link.out[link.payload()] = number
        link.event(0x40, size)
    port.space = 1000
    while not link.idle():
        link.flush()
    parser = wire.Parser()
    parser.feed(bytes(port.outbox))
    for number in range(3):
        sequence, _, payload = parser.next()
        assert (sequence, payload[0], len(payload)) == (number, number, size)


def case_each_hello_tells_what_is_free_now():
    app, host = connected()
    app.controller.free_flash = app.controller.free_heap = -1
    assert host.hello(session=2)[0] == "ok"
    assert app.controller.free_flash > 0
    assert app.controller.free_heap >= 0


def case_what_is_no_longer_used_counts_as_free():
    app, host = connected()
    assert host.hello(session=2)[0] == "ok"
    free = app.controller.free_heap
    if free:  # it is known
        gc.threshold(-1)
        [bytearray(1000) for _ in range(500)]
        assert host.hello(session=3)[0] == "ok"
        assert app.controller.free_heap > free - 100_000, (free, app.controller.free_heap)


def case_a_command_is_looked_up_alone():
    """To parse the whole table takes 40 KB, for which the chip would collect its heap for 0.14 s."""
    if hasattr(gc, "mem_alloc"):
        gc.collect()
        gc.disable()
        before = gc.mem_alloc()
        table.row_of("C", 0x21)
        took = gc.mem_alloc() - before
        gc.enable()
        assert took < 4000, took


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
    app.controller.board.engine.refusal = (21, 1, 5)
    assert start(host) == ("error", "too_fast", 1, 5)
    assert app.controller.board.engine.calls.count("start") == 0
    app.controller.board.engine.refusal = None
    assert start(host) == ("ok", (1, 84000), b"")


def case_only_a_few_commands_while_moving():
    app, host = connected()
    start(host)
    assert state(host) == "moving"
    for name, _, _, fields, _ in wire.COMMAND.values():
        if name in ("output", "inputs", "sequence", "counter"):  # the arm has none, and there was none
            assert host.ask(name, [1] * len(fields))[:2] == ("error", "unknown_command"), name
        elif name != "stop":
            answer = host.ask(name, [1] * len(fields), b"")
            busy = name not in ("hello", "status", "hold", "speed", "samples")
            assert (answer[:2] == ("error", "busy")) == busy, (name, answer)
    assert app.controller.board.engine.calls[-1] == "start"


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
    assert host.ask("put_data", (100,), record[100:300]) == ("ok", (300,), b"")
    assert host.ask("put_data", (300,), record[300:]) == ("ok", (len(record),), b"")
    assert host.ask("put_data", (len(record),), b"x") == ("error", "bad_offset", 255, len(record))
    assert host.ask("put_commit", (wire.record_crc(record),)) == ("ok", (), b"")
    assert host.ask("put_commit", (wire.record_crc(record),))[1] == "bad_offset"


def case_a_new_upload_gives_up_the_one_under_way():
    """Nothing of it stays in the flash."""
    _, host = connected()
    record, crc = host.record, wire.record_crc(host.record)
    assert host.ask("put_begin", (len(record), crc), "two")[0] == "ok"
    assert host.ask("put_data", (0,), record[:50])[0] == "ok"
    assert host.upload("three", record)[-1][0] == "ok"
    assert sorted(os.listdir(flash())) == ["arm.ata", "feed.atm", "three.atm"]


def case_damaged_uploads_are_refused():
    _, host = connected()
    wrong = bytearray(host.record)
    wrong[30] ^= 1
    assert host.upload("feed", bytes(wrong))[-1] == ("error", "bad_checksum", 255, 0)
    assert host.ask("put_begin", (len(host.record), 0), "feed")[0] == "ok"
    for at in range(0, len(host.record), 100):
        assert host.ask("put_data", (at,), host.record[at : at + 100])[0] == "ok"
    assert host.ask("put_commit", (1,)) == ("error", "bad_checksum", 255, 0)  # whole, and not what was meant
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


class Counted:
    """A file that knows whether it was closed."""

    open_paths: "list[str]" = []

    def __init__(self, path, mode):
        self._file = open(path, mode)  # noqa: SIM115  the store closes it
        self._path = path
        Counted.open_paths.append(path)

    def __getattr__(self, name):
        return getattr(self._file, name)

    def close(self):
        self._file.close()
        Counted.open_paths.remove(self._path)


def case_no_file_stays_open():
    """Its buffer would take heap until the next collection."""
    _, host = connected()
    store.open = Counted
    for what in (
        lambda: host.upload("apple", host.record)[-1],
        lambda: host.ask("set_default", (), "apple"),
        lambda: host.ask("list", (0,)),
        lambda: host.ask("get", (0, 90), "apple"),
        lambda: host.ask("rename", (5,), "applefood"),
        lambda: host.ask("remove", (), "food"),
    ):
        assert what()[0] == "ok"
        assert Counted.open_paths == []
    del store.open


def case_default_is_one_content_of_its_name():
    app, host = connected()
    other = stand_in.record(stand_in.arm(), segments=9)
    assert other != host.record
    assert host.ask("set_default", (), "feed")[0] == "ok"
    assert host.upload("feed", other)[-1][0] == "ok"
    assert host.ask("list", (0,))[1][5] == 0
    assert app.controller.board.store().default() == ""  # the button starts nothing
    assert host.upload("feed", host.record)[-1][0] == "ok"
    assert host.ask("list", (0,))[1][5] == 1
    assert app.controller.board.store().default() == "feed"


def case_damaged_file_in_flash_is_not_run():
    app, host = connected()
    name = flash() + "/feed.atm"
    with open(name, "rb") as file:
        data = bytearray(file.read())
    data[40] ^= 4
    with open(name, "wb") as file:
        file.write(data)
    assert start(host) == ("error", "bad_record", 255, 0)
    assert host.ask("list", (0,)) == ("ok", (1, len(data), 0, 0, 0, 0, 0), "feed")
    assert app.controller.board.engine.calls.count("load") == 0


def case_a_folder_in_the_place_of_a_motion_is_not_listed():
    _, host = connected()
    before = host.ask("list", (0,))
    for name in ("aa.atm", "zz.atm"):
        os.mkdir(flash() + "/" + name)
    assert host.ask("list", (0,)) == before
    assert host.ask("list", (1,)) == ("error", "not_found", 255, 0)
    for name in ("aa.atm", "zz.atm"):
        os.rmdir(flash() + "/" + name)


def case_file_that_ends_before_its_size_is_damaged():
    """The folder's entry says more than there is to read."""
    connected()
    name = flash() + "/feed.atm"
    size = os.stat(name)[6]
    for more in (1, 4, 5, 300):
        try:
            motion_file.stated_crc(name, size + more)
        except motion.MotionError:
            continue
        raise AssertionError(more)


def case_other_limits_keep_the_position_another_arm_does_not():
    app, host = connected()
    app.controller.board.engine.steps[:] = [5, -7]
    assert host.upload("/arm", stand_in.arm(low=-10))[-1][0] == "ok"
    assert app.controller.board.engine.calls == ["home"]
    assert (app.controller.board.engine.known, app.controller.board.engine.steps) == (3, [5, -7])
    assert host.upload("/arm", stand_in.arm(flags=1))[-1][0] == "ok"
    assert (app.controller.board.engine.known, app.controller.board.engine.steps) == (0, [0, 0])


cases.run(globals())
