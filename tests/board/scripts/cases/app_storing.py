"""Motions in the program's store: how they come in, under which names, and what is refused."""

# all cases: slow on CPython

import os

import cases
import stand_in
from app_rig import connected, flash, start
from armtempo_board.storage import motion_file, store
from armtempo_shared import motion, wire


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
