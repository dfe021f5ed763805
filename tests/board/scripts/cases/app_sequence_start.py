"""Sequences before they run: stored whole, refused before anything moves."""

# all cases: slow on CPython, not emulated

import gc
from binascii import crc32

import cases
import stand_in
from app_rig import App, connected, flash, state
from armtempo_shared import codes, sequence, wire
from sequence_rig import (
    ARM_CRC,
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
    put,
    ready,
    runs,
    stands,
)


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
        assert runs(app) == 0 and app.controller.board.outputs.log == [] and state(host) == "idle"
    app, host = ready([(OUTPUT, 0, 1, 0)], outputs=0)
    assert begin(host) == ("error", "no_such_pin", 255, 1)


def case_a_repeat_of_one_pass_need_not_lead_back():
    rows = []
    for motion in ("there", "back"):
        rows += [(REPEAT, 0, 0, 1), (MOVE, motion, 0, 0), (END, 0, 1, 0)]
    app, host = ready(rows)
    assert begin(host)[0] == "ok"
    arrive(app, host, 10)
    arrive(app, host, 0)
    assert stands(host)[0] == "finished" and stands(host)[4] == 2


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
    app.controller.board.engine.known = 1
    assert begin(host) == ("error", "unhomed", 1, 0)
    assert host.ask("start", (1, wire.record_crc(host.seq)), "seq")[:2] == ("error", "is_sequence")


def case_without_space_it_is_refused():
    app, host = ready([(WAIT, 0, 0, 1)])
    import armtempo_board.app.sequencer as module

    module.gc = stand_in.Module()
    module.gc.collect = gc.collect
    module.gc.mem_free = lambda: 10_000
    assert begin(host) == ("error", "no_sequence_memory", 255, 12000)
    assert not app.controller.sequence and state(host) == "idle"
    assert host.ask("sequence")[:2] == ("error", "unknown_command")
    module.gc.mem_free = lambda: 24_000
    assert begin(host)[0] == "ok"


def case_no_memory_for_it_is_said_so():
    _, host = ready([(WAIT, 0, 0, 1)])

    def none(*arguments):
        raise MemoryError

    import armtempo_board.app.sequence_start as module

    module.sequencer, kept = none, module.sequencer
    assert begin(host)[:2] == ("error", "no_sequence_memory")
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
        sequence.pack(ARM_CRC, rows, [], [""]),
        sequence.pack(ARM_CRC, rows, [], ["a"] * 9),
        sequence.pack(ARM_CRC, [(COUNT, 1, 0, 0, 1)], [], ["a"]),
        sequence.pack(ARM_CRC, [(COUNT, 0, 0, 1, 1)], [], ["a"]),
    ):
        assert host.upload("seq", bad)[-1][:2] == ("error", "bad_record")
    assert host.ask("get", (0, 200), "seq")[2] == kept
    again = App(host.port, flash())
    assert again.controller.board.store().kind("seq") == 1


def case_one_of_an_older_version_is_named():
    app, host = ready([(WAIT, 0, 0, 1)])
    with open(flash() + "/seq.atm", "rb") as file:
        data = bytearray(file.read())
    data[3] = ord("1")
    data[-4:] = crc32(bytes(data[:-4])).to_bytes(4, "little")
    with open(flash() + "/seq.atm", "wb") as file:
        file.write(data)
    assert host.ask("start", (0, 0), "seq")[:2] == ("error", "other_version")
    assert runs(app) == 0 and not app.controller.sequence
    found = [host.ask("list", (index,)) for index in range(5)]
    assert [fields[1:] for _, fields, name in found if name == "seq"] == [(len(data), 0, 0, 0, 0, 1)]
    assert host.upload("other", bytes(data))[-1][:2] == ("error", "other_version")
    assert host.upload("seq", host.seq)[-1][0] == "ok" and begin(host)[0] == "ok"


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


def case_a_motion_that_is_unfit_is_refused_before_anything_moves():
    app, host = ready([(OUTPUT, 0, 7, 0), (MOVE, "there", 0, 0), (MOVE, "back", 0, 0)])
    app.controller.board.engine.unfit = (codes.TOO_FAST, 1, 5)
    begin(host)
    assert stands(host) == ("refused", codes.TOO_FAST, 3, 2, 0), stands(host)
    assert runs(app) == 0 and app.controller.board.outputs.log == [] and state(host) == "idle"


def case_before_any_the_command_is_unknown():
    _, host = connected()
    assert host.ask("sequence")[:2] == ("error", "unknown_command")


def case_the_button_starts_it_as_the_default():
    app, host = ready([(MOVE, "there", 0, 0), (MOVE, "back", 0, 0)])
    assert host.ask("set_default", (), "seq")[0] == "ok"
    app.controller.begin(app.controller.board.store().default(), 0)
    host.turn(6)
    arrive(app, host, 10)
    arrive(app, host, 0)
    assert stands(host)[0] == "finished"


cases.run(globals())
