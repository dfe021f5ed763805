"""Sequences: stored, refused before anything moves, run step by step, ended by whatever can end one."""

import gc
import sys

import cases
import stand_in
from app_rig import App, connected, flash, start, state
from armtempo_shared import armrecord, codes, motion, sequence, wire

del sys.modules["armtempo_board.motion.endpoints"]  # the real one
from armtempo_board.motion import endpoints  # noqa: E402, F401

MOVE, OUTPUT, WAIT, INPUT = sequence.MOVE, sequence.OUTPUT, sequence.WAIT, sequence.WAIT_INPUT
REPEAT, END = sequence.REPEAT, sequence.END
ARM_CRC = armrecord.unpack(stand_in.arm())[2]
ONE_STEP = 1 << 28
ONE_TICK = 1 << 16


class Outputs:
    """Remembers what was set."""

    def __init__(self, count=2):
        self.values = [0] * count
        self.log = []

    def set(self, number, value):
        self.log.append((number, value))
        self.values[number] = value

    def safe(self):
        pass

    def close(self):
        pass


class Inputs:
    """Levels as a case sets them."""

    count = 1

    def __init__(self):
        self.levels = 0

    def level(self, number):
        return self.levels >> number & 1

    def poll(self, now_ms):
        pass


def leg(first, last, arm_crc=ARM_CRC):
    """A motion of both joints from one step to another."""
    points = [first * ONE_STEP] * 5 + [(first + last) * ONE_STEP // 2] + [last * ONE_STEP] * 5
    times = [1000 * ONE_TICK * index for index in range(len(points))]
    return motion.pack(5, [points, points], [times], 1, 84000, arm_crc)


LEGS = {"there": leg(0, 10), "back": leg(10, 0), "on": leg(10, 20)}


def ready(rows, legs=LEGS, outputs=2):
    """A board with these motions and the sequence "seq", homed at 0; app and host."""
    app, host = connected()
    app.controller.outputs = Outputs(outputs) if outputs else None
    app.controller.inputs = Inputs() if outputs else None
    for name in sorted(legs):
        assert host.upload(name, legs[name])[-1][0] == "ok"
    put(host, rows, legs)
    return app, host


def put(host, rows, legs=LEGS, name="seq"):
    """Store a sequence of rows (op, number, value, amount); MOVE's number is the name of a motion."""
    names = sorted(legs)
    numbered = [
        (row[0], names.index(row[1]) if row[0] == MOVE else row[1], row[2], row[3], step)
        for step, row in enumerate(rows, 1)
    ]
    host.seq = sequence.pack(ARM_CRC, numbered, [(leg, wire.record_crc(legs[leg])) for leg in names])
    answer = host.upload(name, host.seq)[-1]
    assert answer[0] == "ok", answer


def begin(host, name="seq"):
    return host.ask("start", (0, wire.record_crc(host.seq)), name)


def stands(host):
    """(ending, code, step, row, cycle) of the sequence."""
    host.turn(5)
    kind, fields, name = host.ask("sequence")
    assert kind == "ok" and name in ("seq", b"seq"), name
    return (sequence.ENDINGS[fields[0]],) + fields[1:]


def arrive(app, host, at):
    """The leg that is under way ends at these steps."""
    engine = app.controller.engine
    assert engine.moving
    engine.steps = [at, at]
    engine.finish()
    host.turn(5)


def runs(app):
    return app.controller.engine.calls.count("start")


def case_steps_come_one_after_the_other():
    app, host = ready(
        [
            (OUTPUT, 0, 7, 0),
            (MOVE, "there", 0, 0),
            (WAIT, 0, 0, 500),
            (OUTPUT, 1, 65535, 0),
            (MOVE, "back", 0, 0),
        ]
    )
    before = host.ask("status")[1][4]
    assert begin(host) == ("ok", (before, 0), b"")
    assert state(host) == "moving"
    assert stands(host) == ("running", 0, 2, 1, 0)
    assert app.controller.outputs.log == [(0, 7)]
    arrive(app, host, 10)
    assert app.controller.outputs.log == [(0, 7)] and runs(app) == 1
    assert state(host) == "moving"
    stand_in.Clock.now_ms += 500
    host.turn(5)
    assert app.controller.outputs.log == [(0, 7), (1, 65535)] and runs(app) == 2
    arrive(app, host, 0)
    assert state(host) == "idle"
    assert stands(host) == ("finished", 0, 5, 4, 0)
    assert host.ask("status")[1][4] == before + 2


def case_repeats_within_repeats_are_counted():
    rows = [
        (REPEAT, 0, 0, 3),
        (OUTPUT, 0, 1, 0),
        (REPEAT, 0, 0, 2),
        (OUTPUT, 1, 2, 0),
        (END, 0, 0, 0),
        (END, 0, 1, 0),
    ]
    app, host = ready(rows)
    begin(host)
    host.turn(100)
    assert stands(host)[0] == "finished" and stands(host)[4] == 3
    assert app.controller.outputs.log == [(0, 1), (1, 2), (1, 2)] * 3


def case_for_ever_ends_only_by_a_stop():
    app, host = ready([(REPEAT, 0, 0, 0), (MOVE, "there", 0, 0), (MOVE, "back", 0, 0), (END, 0, 1, 0)])
    begin(host)
    for _ in range(20):
        arrive(app, host, 10)
        arrive(app, host, 0)
    assert stands(host) == ("running", 0, 2, 1, 20)
    assert host.ask("stop", (0,)) == ("ok", (), b"")
    assert state(host) == "braking"
    arrive(app, host, 4)
    assert stands(host) == ("stopped", 0, 2, 1, 20)
    assert state(host) == "idle" and not app.controller.sequence
    assert host.ask("stop", (0,))[1] == "not_moving"
    assert begin(host) == ("error", "wrong_start", 0, -4)


def case_a_stop_ends_a_wait():
    app, host = ready([(WAIT, 0, 0, 600000), (OUTPUT, 0, 1, 0)])
    begin(host)
    assert state(host) == "moving" and stands(host)[0] == "running"
    assert host.ask("stop", (0,)) == ("ok", (), b"")
    assert stands(host) == ("stopped", 0, 1, 0, 0)
    assert app.controller.outputs.log == [] and state(host) == "idle"


def case_an_input_lets_it_go_on():
    app, host = ready([(INPUT, 0, 1, 0), (OUTPUT, 0, 1, 0), (INPUT, 0, 0, 0), (OUTPUT, 0, 0, 0)])
    begin(host)
    stand_in.Clock.now_ms += 3_000_000
    assert stands(host) == ("running", 0, 1, 0, 0)
    app.controller.inputs.levels = 1
    assert stands(host) == ("running", 0, 3, 2, 0)
    app.controller.inputs.levels = 0
    assert stands(host)[0] == "finished"
    assert app.controller.outputs.log == [(0, 1), (0, 0)]


def _waited_in_vain(then):
    app, host = ready([(INPUT, 0, 1 | then, 5000), (OUTPUT, 0, 1, 0)])
    begin(host)
    stand_in.Clock.now_ms += 4800
    assert stands(host)[0] == "running"
    stand_in.Clock.now_ms += 300
    host.turn(5)
    return app, host


def case_an_input_that_never_comes_stops_it():
    app, host = _waited_in_vain(sequence.STOP_THEN)
    assert stands(host) == ("timed_out", 0, 1, 0, 0)
    assert state(host) == "idle" and app.controller.outputs.log == []


def case_an_input_that_never_comes_is_a_fault():
    app, host = _waited_in_vain(sequence.FAULT_THEN)
    assert stands(host) == ("fault", codes.INPUT_TIMEOUT, 1, 0, 0)
    assert state(host) == "fault" and app.controller.outputs.log == []
    assert begin(host)[:2] == ("error", "fault_pending")
    assert host.ask("clear") == ("ok", (), b"")
    assert begin(host)[0] == "ok"


def case_an_input_that_never_comes_is_passed_over():
    app, host = _waited_in_vain(sequence.NEXT_THEN)
    assert stands(host)[0] == "finished" and app.controller.outputs.log == [(0, 1)]


def case_a_fault_ends_it_and_says_where():
    app, host = ready([(MOVE, "there", 0, 0), (OUTPUT, 0, 1, 0), (MOVE, "back", 0, 0)])
    begin(host)
    engine = app.controller.engine
    engine.fault = codes.LIMIT_SWITCH
    engine.moving = False
    host.turn(5)
    assert stands(host) == ("fault", codes.LIMIT_SWITCH, 1, 0, 0)
    assert app.controller.outputs.log == [] and state(host) == "fault"


def case_a_fault_in_a_wait_ends_it():
    app, host = ready([(WAIT, 0, 0, 100000), (OUTPUT, 0, 1, 0)])
    begin(host)
    app.controller.engine.fault = codes.ESTOP
    assert stands(host) == ("fault", codes.ESTOP, 1, 0, 0)
    assert app.controller.outputs.log == []


def case_a_mistake_of_the_program_ends_it():
    app, host = ready([(WAIT, 0, 0, 100000), (OUTPUT, 0, 1, 0)])
    begin(host)
    app.controller.engine.explode = ValueError("x")
    assert stands(host) == ("fault", codes.INTERNAL, 1, 0, 0)
    assert app.controller.outputs.log == []


def case_what_cannot_go_on_is_named():
    app, host = ready([(MOVE, "there", 0, 0), (MOVE, "back", 0, 0)])
    begin(host)
    app.controller.engine.refusal = (codes.TOO_FAST, 1, 5)
    arrive(app, host, 10)
    assert stands(host) == ("refused", codes.TOO_FAST, 2, 1, 0)
    assert state(host) == "idle"


def case_nothing_else_is_taken_meanwhile():
    _, host = ready([(WAIT, 0, 0, 100000)])
    begin(host)
    for name, values, tail in (
        ("start", (0, 0), "feed"),
        ("remove", (), "there"),
        ("home", (3,), bytes(8)),
        ("put_begin", (100, 0), "x"),
        ("list", (0,), b""),
        ("leave", (), b""),
    ):
        assert host.ask(name, values, tail)[:2] == ("error", "busy"), name
    assert host.ask("status")[0] == host.ask("hello", (wire.PROTOCOL_VERSION, 9))[0] == "ok"
    assert stands(host)[0] == "running"


def case_before_any_the_command_is_unknown():
    _, host = connected()
    assert host.ask("sequence")[:2] == ("error", "unknown_command")


def case_while_a_motion_runs_the_last_one_is_told():
    _, host = ready([(WAIT, 0, 0, 10)])
    begin(host)
    host.turn(20)
    start(host)
    assert stands(host) == ("finished", 0, 1, 0, 0)


def case_hosts_come_and_go():
    app, host = ready([(REPEAT, 0, 0, 5), (MOVE, "there", 0, 0), (MOVE, "back", 0, 0), (END, 0, 1, 0)])
    begin(host)
    for cycle in range(5):
        host.hello(cycle + 2)
        arrive(app, host, 10)
        stand_in.Clock.now_ms += 60_000
        arrive(app, host, 0)
    assert stands(host) == ("finished", 0, 4, 3, 5)


def case_silence_of_the_host_stops_it_where_the_arm_says_so():
    app, host = connected(flags=armrecord.FLAG_STOP_ON_LINK_LOSS)
    crc = armrecord.unpack(stand_in.arm(flags=armrecord.FLAG_STOP_ON_LINK_LOSS))[2]
    legs = {"there": leg(0, 10, crc)}
    host.upload("there", legs["there"])
    host.seq = sequence.pack(crc, [(MOVE, 0, 0, 0, 1)], [("there", wire.record_crc(legs["there"]))])
    host.upload("seq", host.seq)
    assert begin(host)[0] == "ok"
    stand_in.Clock.now_ms += 1000
    host.turn(3)
    assert app.controller.engine.calls[-1] == "brake"
    arrive(app, host, 5)
    assert stands(host) == ("fault", codes.LINK_LOST, 1, 0, 0)


def case_speed_holds_for_the_motions_that_follow():
    app, host = ready([(MOVE, "there", 0, 0), (MOVE, "back", 0, 0)])
    begin(host)
    assert host.ask("speed", (300,))[0] == "ok"
    host.hello(7)
    arrive(app, host, 10)
    assert app.controller.engine.rates.wanted == 300
    arrive(app, host, 0)
    begin(host)
    assert app.controller.engine.rates.wanted == 1000
    arrive(app, host, 10)
    assert host.ask("speed", (0,))[0] == "ok"


def case_speed_between_motions_is_that_of_the_next():
    app, host = ready([(WAIT, 0, 0, 5000), (MOVE, "there", 0, 0)])
    begin(host)
    assert host.ask("speed", (0,))[:2] == ("error", "not_moving")
    assert host.ask("speed", (200,))[0] == "ok"
    stand_in.Clock.now_ms += 5000
    host.turn(5)
    assert app.controller.engine.rates.wanted == 200


def case_the_button_starts_it_as_the_default():
    app, host = ready([(MOVE, "there", 0, 0), (MOVE, "back", 0, 0)])
    assert host.ask("set_default", (), "seq")[0] == "ok"
    app.controller.begin(app.controller.store().default(), 0)
    host.turn(3)
    arrive(app, host, 10)
    arrive(app, host, 0)
    assert stands(host)[0] == "finished"


def case_refused_before_anything_moves():
    there, back, on = (MOVE, "there", 0, 0), (MOVE, "back", 0, 0), (MOVE, "on", 0, 0)
    for rows, refusal in (
        ([(OUTPUT, 0, 1, 0), there, there], ("leg_elsewhere", 0, 3)),
        ([there, on, back], ("leg_elsewhere", 0, 3)),
        ([(REPEAT, 0, 0, 2), there, (END, 0, 0, 0)], ("leg_elsewhere", 0, 3)),
        ([(OUTPUT, 0, 1, 0), back], ("wrong_start", 0, 10)),
        ([there, (OUTPUT, 2, 1, 0)], ("no_such_pin", 255, 2)),
        ([there, (INPUT, 1, 1, 0)], ("no_such_pin", 255, 2)),
    ):
        app, host = ready(rows)
        assert begin(host) == ("error",) + refusal, rows
        assert runs(app) == 0 and app.controller.outputs.log == [] and state(host) == "idle"
    app, host = ready([(OUTPUT, 0, 1, 0)], outputs=0)
    assert begin(host) == ("error", "no_such_pin", 255, 1)


def case_a_motion_that_is_gone_or_another_is_named():
    app, host = ready([(MOVE, "there", 0, 0), (MOVE, "back", 0, 0)])
    host.ask("remove", (), "there")
    assert begin(host) == ("error", "leg_missing", 255, 3)
    host.upload("there", LEGS["on"])
    assert begin(host) == ("error", "leg_missing", 255, 3)
    put(host, [(WAIT, 0, 0, 1)], {}, "there")
    host.seq = sequence.pack(ARM_CRC, [(MOVE, 0, 0, 0, 1)], [("there", wire.record_crc(host.seq))])
    host.upload("seq", host.seq)
    assert begin(host) == ("error", "leg_missing", 255, 1)
    assert runs(app) == 0


def case_of_another_arm_it_is_refused():
    _, host = ready([(WAIT, 0, 0, 1)])
    host.seq = sequence.pack(ARM_CRC ^ 1, [(WAIT, 0, 0, 1, 1)], [])
    host.upload("seq", host.seq)
    assert begin(host)[:2] == ("error", "arm_mismatch")
    assert host.ask("start", (0, 1), "seq")[:2] == ("error", "bad_checksum")


def case_unhomed_it_is_refused():
    app, host = ready([(WAIT, 0, 0, 1)])
    app.controller.engine.known = 1
    assert begin(host) == ("error", "unhomed", 1, 0)
    assert host.ask("start", (1, wire.record_crc(host.seq)), "seq")[:2] == ("error", "is_sequence")


def case_without_room_it_is_refused():
    app, host = ready([(WAIT, 0, 0, 1)])
    import armtempo_board.app.sequencer as module

    module.gc = stand_in.Module()
    module.gc.collect = gc.collect
    module.gc.mem_free = lambda: 10_000
    assert begin(host) == ("error", "no_sequence_room", 255, 8000)
    assert not app.controller.sequence and state(host) == "idle"
    assert host.ask("sequence")[:2] == ("error", "unknown_command")
    module.gc.mem_free = lambda: 20_000
    assert begin(host)[0] == "ok"


def case_no_memory_for_it_is_said_so():
    _, host = ready([(WAIT, 0, 0, 1)])

    def none(*arguments):
        raise MemoryError

    import armtempo_board.app.sequence_start as module

    module.sequencer, kept = none, module.sequencer
    assert begin(host)[:2] == ("error", "no_sequence_room")
    module.sequencer = kept
    assert host.ask("start", (0, wire.record_crc(host.record)), "feed")[0] == "ok"


def case_the_list_tells_motions_and_sequences_apart():
    _, host = ready([(WAIT, 0, 0, 1)])
    found = {}
    for index in range(5):
        _, fields, name = host.ask("list", (index,))
        found[name] = fields
    assert found["seq"] == (5, len(host.seq), wire.record_crc(host.seq), 0, 0, 0, 1)
    assert found["there"][6] == 0 and found["there"][4] == 2


def case_a_sequence_is_stored_whole_or_not_at_all():
    _, host = ready([(WAIT, 0, 0, 1)])
    kept = host.seq
    rows = [(WAIT, 0, 0, 1, 1)]
    for bad in (
        sequence.pack(ARM_CRC, [(9, 0, 0, 1, 1)], []),
        sequence.pack(ARM_CRC, [(MOVE, 0, 0, 0, 1)], []),
        sequence.pack(ARM_CRC, [(REPEAT, 0, 0, 0, 1)], []),
        sequence.pack(ARM_CRC, [(END, 0, 0, 0, 1)], []),
        sequence.pack(ARM_CRC, [(WAIT, 0, 0, 1 << 31, 1)], []),
        sequence.pack(ARM_CRC, [(WAIT, 0, 0, 1, 0)], []),
        sequence.pack(ARM_CRC, [(REPEAT, 0, 0, 2, 1)] * 5 + [(END, 0, 0, 0, 1)] * 5, []),
        sequence.pack(ARM_CRC, [], []),
        sequence.pack(ARM_CRC, rows, [("", 1)]),
    ):
        assert host.upload("seq", bad)[-1][:2] == ("error", "bad_record")
    assert host.ask("get", (0, 200), "seq")[2] == kept
    again = App(host.port, flash())
    assert again.controller.store().is_sequence("seq")


def case_a_power_cut_before_the_rename_loses_nothing():
    _, host = ready([(WAIT, 0, 0, 1)])
    path = flash() + "/seq.atm"
    with open(path, "rb") as file:
        data = file.read()
    import os

    os.rename(path, path + ".new")
    App(host.port, flash())
    with open(path, "rb") as file:
        assert file.read() == data
    with open(path + ".new", "wb") as file:
        file.write(data[:-1])
    App(host.port, flash())
    assert "seq.atm.new" not in os.listdir(flash())


cases.run(globals())
