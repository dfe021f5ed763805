"""Commands to the program above the engine: which are carried out, which refused, which are a repetition."""

# all cases: slow on CPython

import cases
import stand_in
from app_rig import ROOT, App, connected, start, state
from armtempo_board.link.serial_link import SerialLink
from armtempo_shared import wire


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
    host.port.room = 0
    app.controller.board.engine.advance(3)
    host.turn()
    assert not app.link.idle()  # samples wait for a host that does not read
    host.events.clear()
    host.send("hello", (wire.PROTOCOL_VERSION, 2))
    host.turn()
    host.port.room = 1 << 30
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


def case_what_the_port_took_makes_room():
    """A piece of an event is enough; what stays after it comes whole."""
    port = stand_in.Port()
    link = SerialLink(port)
    size = 250
    port.room = 200
    for number in range(3):
        while not link.room(size):
            assert number == 2
            assert port.room, "no room for the third, though there are bytes free"
            link.flush()
        link.out[link.payload()] = number
        link.event(0x40, size)
    port.room = 1000
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


cases.run(globals())
