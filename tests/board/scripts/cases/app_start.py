"""Starts with records in the flash that cannot be used: the program starts, names them, and all else works."""

# all cases: slow on CPython, not emulated

import struct
import sys

import cases
import stand_in

from app_rig import ROOT  # isort: skip  it puts the stand-ins into place

from armtempo_board.app import board
from armtempo_board.app.app import App
from armtempo_shared import armrecord, engine_memory, wire

NUMBER = [0]
ARM_CRC, PROBLEM, VALUE = 9, -2, -1


def folder_with(arm):
    """A store whose arm record has these bytes."""
    NUMBER[0] += 1
    root = "%s-start-%d" % (ROOT, NUMBER[0])
    App(stand_in.Port(), root)  # makes the folder
    with open(root + "/arm.ata", "wb") as file:
        file.write(arm)
    return root


def started(root):
    """The program on this store, greeted; what hello says."""
    port = stand_in.Port()
    app = App(port, root)
    host = stand_in.Host(app, port)
    answer = host.hello()
    assert answer[0] == "ok"
    return app, host, answer[1]


def names_it(arm, problem, value=0):
    """A start with this record; then a good one is taken."""
    root = folder_with(arm)
    _, host, hello = started(root)
    assert (hello[1], hello[ARM_CRC]) == (0, 0)
    assert (wire.ERRORS[hello[PROBLEM]][0], hello[VALUE]) == (problem, value), hello
    assert host.ask("list", (0,)) == ("error", "not_found", 255, 0)
    good = stand_in.arm()
    assert host.upload("/arm", good)[-1] == ("ok", (), b"")
    hello = host.hello()[1]
    assert (hello[1], hello[ARM_CRC], hello[PROBLEM]) == (2, wire.record_crc(good), 0)


def with_crc(data):
    return data + struct.pack("<I", armrecord.crc32(data))


def case_no_record_is_no_problem():
    assert started(folder_with(stand_in.arm()))[2][PROBLEM] == 0
    assert started(ROOT + "-none")[2][PROBLEM] == 0


def case_damaged_records_are_named():
    arm = stand_in.arm()
    for broken in (b"", arm[:7], arm[:-1], arm[:-4] + b"abcd", b"x" * 300):
        names_it(broken, "bad_record")


def case_another_version_is_named():
    arm = bytearray(stand_in.arm()[:-4])
    arm[4] = armrecord.VERSION_WITH_OUTPUTS + 1
    names_it(with_crc(bytes(arm)), "bad_record")


def case_what_the_board_has_not_is_named():
    head, joints, _ = armrecord.unpack(stand_in.arm())
    for name, value in (
        ("channel", 6),
        ("encoder", 4),
        ("limit_low", 3),
        ("limit_high", armrecord.POLLED + 0x50),
        ("counts_den", 0),
        ("min_steps", 2000),
    ):
        wrong = [dict(joints[0]), dict(joints[1])]
        wrong[1][name] = value
        names_it(armrecord.pack(head, wrong), "bad_record")
    names_it(armrecord.pack(head, [joints[0], joints[0]]), "bad_record")


class Cramped:
    """A board with less memory for engines."""

    room = engine_memory.needed_bytes([1])
    is_short = True


def case_a_record_that_no_longer_fits_is_named():
    arm = stand_in.arm()
    root = folder_with(arm)
    room = sys.modules["armtempo_board.app.room"]
    room.workspace, before = Cramped, room.workspace
    try:
        _, host, hello = started(root)
    finally:
        room.workspace = before
    needed = engine_memory.needed_bytes([1, 1])
    assert (wire.ERRORS[hello[PROBLEM]][0], hello[VALUE]) == ("no_room", needed)
    small = stand_in.arm(joints=1)
    assert host.upload("/arm", small)[-1] == ("ok", (), b"")
    assert host.upload("/arm", arm)[-1] == ("error", "no_room", 255, needed)
    assert host.hello()[1][ARM_CRC] == wire.record_crc(small)
    with open(root + "/arm.ata", "rb") as file:
        assert file.read() == small, "what does not fit does not take the old one's place"


def case_an_engine_that_cannot_be_made_is_named():
    root = folder_with(stand_in.arm())
    engine = board.Engine
    for error, problem in ((MemoryError, "no_memory"), (ValueError, "failed")):

        def broken(*arguments, error=error):
            raise error

        board.Engine = broken
        try:
            _, _, hello = started(root)
        finally:
            board.Engine = engine
        assert (hello[1], wire.ERRORS[hello[PROBLEM]][0]) == (0, problem)


def case_a_damaged_motion_is_listed_and_refused():
    arm = stand_in.arm()
    root = folder_with(arm)
    for name, data in (("cut", b"ATM4"), ("empty", b""), ("noise", bytes(20000))):
        with open(root + "/" + name + ".atm", "wb") as file:
            file.write(data)
    _, host, hello = started(root)
    assert hello[PROBLEM] == 0
    assert host.ask("home", (3,), bytes(8))[0] == "ok"
    for number, (name, size) in enumerate((("cut", 4), ("empty", 0), ("noise", 20000))):
        assert host.ask("list", (number,)) == ("ok", (3, size, 0, 0, 0, 0, 0), name)
        assert host.ask("start", (0, 1), name.encode())[:2] == ("error", "bad_record")
    assert host.ask("remove", (), "noise") == ("ok", (), b"")
    assert host.ask("list", (0,))[1][0] == 2


cases.run(globals())
