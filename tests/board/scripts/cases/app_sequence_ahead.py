"""Sequences that prepare the next motion while one runs, or between two."""

# all cases: slow on CPython, not emulated

import cases
import stand_in
from sequence_rig import (
    COUNT,
    END,
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


def loads(app):
    """How each motion was loaded."""
    return [call[len("load ") :] for call in app.controller.board.engine.calls if call.startswith("load")]


def case_what_comes_next_is_prepared_over_rows_between():
    """Repeats that end and begin, outputs, counts and waits, none of which is done before its time."""
    rows = [
        (REPEAT, 0, 0, 2),
        (MOVE, "there", 0, 0),
        (END, 0, 0, 0),
        (OUTPUT, 0, 5, 0),
        (COUNT, 0, 0, 0),
        (REPEAT, 0, 0, 2),
        (WAIT, 0, 0, 500),
        (END, 0, 0, 0),
        (MOVE, "on", 0, 0),
        (OUTPUT, 0, 6, 0),
    ]
    app, host = ready(rows, {"there": leg(0, 0), "on": leg(0, 3)}, counters=("many",))
    engine, log = app.controller.board.engine, app.controller.board.outputs.log
    assert begin(host)[0] == "ok"
    arrive(app, host, 0)
    host.turn(30)
    assert engine.calls.count("prepare") == 2 and log == [] and counters_of(host) == {"many": 0}
    arrive(app, host, 0)
    assert not engine.moving and log == [(0, 5)] and counters_of(host) == {"many": 1}
    for _ in range(2):
        stand_in.Clock.now_ms += 500
        host.turn(5)
    assert loads(app) == ["unchecked", "ready", "ready"]
    host.turn(30)
    assert engine.calls.count("prepare") == 2, "nothing comes"
    arrive(app, host, 3)
    assert stands(host)[0] == "finished" and log == [(0, 5), (0, 6)]


def case_without_memory_nothing_is_prepared():
    """Not when the sequence begins; or a motion is given up in the midst, and those after it."""
    for late in (False, True):
        app, host = ready([(REPEAT, 0, 0, 2), (MOVE, "there", 0, 0), (MOVE, "back", 0, 0), (END, 0, 1, 0)])
        engine = app.controller.board.engine
        engine.no_memory = not late
        engine.has_time = False
        begin(host)
        engine.no_memory = engine.has_time = True
        host.turn(20)
        for at in (10, 0, 10, 0):
            arrive(app, host, at)
        assert stands(host)[0] == "finished" and loads(app) == ["unchecked"] * 4
        assert engine.calls.count("prepare") == late
        assert engine.calls.count("give back") == late


def case_where_the_arm_stands_elsewhere_what_is_prepared_is_given_up():
    app, host = ready([(REPEAT, 0, 0, 2), (MOVE, "there", 0, 0), (MOVE, "back", 0, 0), (END, 0, 1, 0)])
    engine = app.controller.board.engine
    begin(host)
    host.turn(20)
    assert engine.calls.count("prepare") == 1
    arrive(app, host, 9)
    assert loads(app) == ["unchecked", "unchecked"]
    arrive(app, host, 0)
    arrive(app, host, 9)
    assert loads(app) == ["unchecked", "unchecked", "ready", "ready"], "it ends there each time"


def case_without_time_it_is_prepared_between_two():
    """And while it waits."""
    app, host = ready([(MOVE, "there", 0, 0), (MOVE, "back", 0, 0), (WAIT, 0, 0, 500), (MOVE, "there", 0, 0)])
    engine = app.controller.board.engine
    engine.has_time = False
    begin(host)
    assert "prepare" not in engine.calls
    arrive(app, host, 10)
    assert loads(app) == ["unchecked", "ready"]
    host.ask("speed", (500,))
    arrive(app, host, 0)
    host.turn(20)
    assert engine.calls.count("prepare") == 2 and not engine.moving
    stand_in.Clock.now_ms += 500
    host.turn(5)
    assert loads(app) == ["unchecked", "ready", "ready"]


def case_behind_a_stop_nothing_is_prepared():
    app, host = ready([(MOVE, "there", 0, 0), (MOVE, "back", 0, 0)])
    app.controller.board.engine.has_time = False
    begin(host)
    host.ask("stop", (0,))
    app.controller.board.engine.has_time = True
    host.turn(20)
    assert "prepare" not in app.controller.board.engine.calls
    arrive(app, host, 4)
    assert stands(host)[0] == "stopped" and runs(app) == 1


cases.run(globals())
