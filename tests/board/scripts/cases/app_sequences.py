"""Sequences that run: step by step, ended by whatever can end one."""

# all cases: slow on CPython, not emulated

import gc

import cases
import stand_in
from app_rig import connected, flash, start, state
from armtempo_board import heap
from armtempo_shared import armrecord, codes, messages, sequence, wire
from sequence_rig import (
    COUNT,
    END,
    INPUT,
    LEGS,
    MOVE,
    OUTPUT,
    REPEAT,
    WAIT,
    arrive,
    begin,
    counters_of,
    leg,
    ready,
    runs,
    stands,
)


def case_steps_come_one_after_the_other():  # emulated
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
    assert app.controller.board.outputs.log == [(0, 7)]
    arrive(app, host, 10)
    assert app.controller.board.outputs.log == [(0, 7)] and runs(app) == 1
    assert state(host) == "moving"
    stand_in.Clock.now_ms += 500
    host.turn(5)
    assert app.controller.board.outputs.log == [(0, 7), (1, 65535)] and runs(app) == 2
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
    assert app.controller.board.outputs.log == [(0, 1), (1, 2), (1, 2)] * 3


def rows_of(host):
    """(passed, row, value) of the events of rows; they are taken off."""
    found = [(fields[0], fields[2], fields[5]) for kind, fields, _ in host.events if kind == "row"]
    host.events = []
    return found


COUNTING = [(REPEAT, 0, 0, 3), (COUNT, 1, 0, 0), (WAIT, 0, 0, 5000), (END, 0, 1, 0), (COUNT, 0, 0, 0)]


def case_counters_count_until_it_begins_anew():  # emulated
    _, host = ready(COUNTING, counters=("trays", "parts"))
    begin(host)
    assert counters_of(host) == {"trays": 0, "parts": 1}
    stand_in.Clock.now_ms += 5000
    host.turn(5)
    assert counters_of(host) == {"trays": 0, "parts": 2}
    for _ in range(2):
        stand_in.Clock.now_ms += 5000
        host.turn(5)
    assert stands(host)[0] == "finished"
    assert counters_of(host) == {"trays": 1, "parts": 3}
    host.hello(5)
    assert counters_of(host) == {"trays": 1, "parts": 3}
    begin(host)
    assert counters_of(host) == {"trays": 0, "parts": 1}


def case_without_counters_there_are_none():
    _, host = ready([(WAIT, 0, 0, 1)])
    assert host.ask("counter", (0,))[:2] == ("error", "unknown_command")
    begin(host)
    assert counters_of(host) == {}


def case_each_row_is_told_when_it_begins():
    _, host = ready(COUNTING, counters=("trays", "parts"))
    host.turn()
    host.events = []
    begin(host)
    for _ in range(3):
        stand_in.Clock.now_ms += 5000
        host.turn()
    once = [0, 1, 2, 3]
    rows = rows_of(host)
    assert [row for _, row, _ in rows] == once + once[1:] * 2 + [4]
    assert [passed for passed, _, _ in rows] == list(range(1, len(rows) + 1))
    assert [value for _, row, value in rows if row == 1] == [1, 2, 3] and rows[-1][2] == 1
    assert not any(value for _, row, value in rows if row in (0, 2, 3))


def case_a_motions_row_is_told_with_its_run():
    app, host = ready([(MOVE, "there", 0, 0), (WAIT, 0, 0, 10), (MOVE, "back", 0, 0)])
    host.turn()
    host.events = []
    run = host.ask("status")[1][4]
    begin(host)
    arrive(app, host, 10)
    host.turn(20)
    told = [(fields[1], fields[2]) for kind, fields, _ in host.events if kind == "row"]
    assert told == [(run + 1, 0), (run + 1, 1), (run + 2, 2)]


def case_no_sample_of_a_motion_is_dropped_when_the_next_begins():  # emulated
    """Not the last one either, which is taken in the pass that starts the next motion; lost ones come again."""
    app, host = ready([(REPEAT, 0, 0, 2), (MOVE, "there", 0, 0), (MOVE, "back", 0, 0), (END, 0, 1, 0)])
    engine = app.controller.board.engine
    begun = host.ask("status")[1][4]
    begin(host)
    for at in (10, 0, 10, 0):
        host.turn(30)
        engine.advance(1)
        engine.steps = [at, at]
        engine.sample()
        engine.finish()
    host.turn(30)
    sent = [(begun + run, 3 * (run - 1) + number) for run in (1, 2, 3, 4) for number in range(3)]
    found = [fields[:2] for kind, fields, _ in host.events if kind == "sample"]
    assert found == sent, found
    host.events = []
    host.ask("samples", (1, 300))
    host.turn()
    assert [fields[:2] for kind, fields, _ in host.events if kind == "sample"] == sent[1:]
    begin(host)
    host.turn(5)
    assert [fields[:2] for kind, fields, _ in host.events if kind == "sample"][-1] == (begun + 5, 0)


def case_a_motion_is_checked_once_in_a_run():
    """Again in the next run; one whose start was refused counts as unchecked."""
    app, host = ready([(REPEAT, 0, 0, 2), (MOVE, "there", 0, 0), (MOVE, "back", 0, 0), (END, 0, 1, 0)])
    engine = app.controller.board.engine
    for _ in range(2):
        engine.calls.clear()
        begin(host)
        for at in (10, 0, 10, 0):
            arrive(app, host, at)
            assert not engine.skip_check
        checks = [call for call in engine.calls if call == "check" or call.startswith("load")]
        assert checks == ["check"] * 3 + ["load unchecked"] + ["load ready"] * 3, checks
    start(host)
    assert engine.calls[-2:] == ["load", "start"]


def case_a_record_that_is_another_now_is_refused_though_it_was_checked():
    app, host = ready([(REPEAT, 0, 0, 2), (MOVE, "there", 0, 0), (MOVE, "back", 0, 0), (END, 0, 1, 0)])
    begin(host)
    app.controller.board.engine.has_time = False
    arrive(app, host, 10)
    with open(flash() + "/there.atm", "r+b") as file:
        file.seek(100)
        file.write(b"\x55")
    arrive(app, host, 0)
    assert stands(host)[:2] == ("refused", codes.BAD_RECORD), stands(host)
    assert runs(app) == 2 and not app.controller.board.engine.skip_check


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
    assert app.controller.board.outputs.log == [] and state(host) == "idle"


def case_an_input_lets_it_go_on():
    app, host = ready([(INPUT, 0, 1, 0), (OUTPUT, 0, 1, 0), (INPUT, 0, 0, 0), (OUTPUT, 0, 0, 0)])
    begin(host)
    stand_in.Clock.now_ms += 3_000_000
    assert stands(host) == ("running", 0, 1, 0, 0)
    app.controller.board.inputs.levels = 1
    assert stands(host) == ("running", 0, 3, 2, 0)
    app.controller.board.inputs.levels = 0
    assert stands(host)[0] == "finished"
    assert app.controller.board.outputs.log == [(0, 1), (0, 0)]


def case_an_input_that_never_comes_stops_it_or_is_a_fault_or_is_passed_over():
    for then, ends, log in (
        (sequence.STOP_THEN, ("timed_out", 0, 1, 0, 0), []),
        (sequence.NEXT_THEN, ("finished", 0, 2, 1, 0), [(0, 1)]),
        (sequence.FAULT_THEN, ("fault", codes.INPUT_TIMEOUT, 1, 0, 0), []),
    ):
        app, host = ready([(INPUT, 0, 1 | then, 5000), (OUTPUT, 0, 1, 0)])
        begin(host)
        stand_in.Clock.now_ms += 4800
        assert stands(host)[0] == "running"
        stand_in.Clock.now_ms += 300
        host.turn(5)
        assert stands(host) == ends and app.controller.board.outputs.log == log
        assert state(host) == ("fault" if ends[0] == "fault" else "idle")
    assert begin(host)[:2] == ("error", "fault_pending")
    assert host.ask("clear") == ("ok", (), b"")
    assert begin(host)[0] == "ok"


def case_a_fault_or_a_mistake_of_the_program_ends_it_and_says_where():
    wait, move = (WAIT, 0, 0, 100000), (MOVE, "there", 0, 0)
    for row, name, value, code in (
        (move, "fault", codes.LIMIT_SWITCH, codes.LIMIT_SWITCH),
        (wait, "fault", codes.ESTOP, codes.ESTOP),
        (wait, "explode", ValueError("x"), codes.INTERNAL),
    ):
        app, host = ready([row, (OUTPUT, 0, 1, 0)])
        begin(host)
        setattr(app.controller.board.engine, name, value)
        app.controller.board.engine.moving = False
        host.turn(5)
        assert stands(host) == ("fault", code, 1, 0, 0)
        assert app.controller.board.outputs.log == [] and state(host) == "fault"


def case_what_cannot_go_on_is_named():
    app, host = ready([(MOVE, "there", 0, 0), (MOVE, "back", 0, 0)])
    begin(host)
    app.controller.board.engine.refusal = (codes.TOO_FAST, 1, 5)
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
    assert app.controller.board.engine.calls[-1] == "brake"
    arrive(app, host, 5)
    assert stands(host) == ("fault", codes.LINK_LOST, 1, 0, 0)


def case_speed_holds_for_the_motions_that_follow():  # emulated
    app, host = ready([(MOVE, "there", 0, 0), (MOVE, "back", 0, 0)])
    begin(host)
    assert host.ask("speed", (300,))[0] == "ok"
    host.hello(7)
    arrive(app, host, 10)
    assert app.controller.board.engine.rates.wanted == 300
    assert app.controller.board.engine.calls.count("load ready") == 1
    arrive(app, host, 0)
    begin(host)
    assert app.controller.board.engine.rates.wanted == 1000
    arrive(app, host, 10)
    assert host.ask("speed", (0,))[0] == "ok"


def case_speed_between_motions_is_that_of_the_next():
    app, host = ready([(WAIT, 0, 0, 5000), (MOVE, "there", 0, 0)])
    begin(host)
    assert host.ask("speed", (0,))[:2] == ("error", "not_moving")
    assert host.ask("speed", (200,))[0] == "ok"
    stand_in.Clock.now_ms += 5000
    host.turn(5)
    assert app.controller.board.engine.rates.wanted == 200


def case_the_heap_is_collected_seldom_where_memory_is_not_short():  # emulated
    if not hasattr(gc, "mem_free"):
        return
    before = gc.threshold()
    app, host = ready([(MOVE, "there", 0, 0), (WAIT, 0, 0, 50)])
    try:
        begin(host)
        assert gc.threshold() == -1, "while a motion runs"
        arrive(app, host, 10)
        host.turn(100)
        assert stands(host)[0] == "finished"
        often = gc.threshold()
        heap.collect_often(heap.SELDOM)
        assert gc.threshold() > 3 * often > 0
    finally:
        gc.threshold(before)


def case_it_gets_the_memory_of_the_motion_that_is_run_once():
    app, host = ready([(MOVE, "there", 0, 0)])
    record = LEGS["there"]
    once = (0, wire.record_crc(record))
    assert host.ask("put_once", (0, len(record)), record)[0] == "ok"
    assert begin(host)[0] == "ok"
    host.turn(5)
    app.controller.board.engine.finish()
    host.turn(5)
    assert host.ask("start", once, messages.ONCE_NAME) == ("error", "not_found", 255, 0)
    assert host.ask("put_once", (0, len(record)), record)[0] == "ok"
    assert host.ask("start", once, messages.ONCE_NAME)[1] != "not_found"


cases.run(globals())
