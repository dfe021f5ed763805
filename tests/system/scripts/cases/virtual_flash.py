"""The simulated flash, case by case: its size, and what is left of it if the power fails.

Argument: a scratch folder.
"""

import sys

import bare_board  # replaces time, os, uctypes, micropython; so before everything else
import cases
from machine_state import Reset

# isort: split
import os

import machine

SCRATCH = sys.argv[1]


def case_flash_is_as_big_as_the_chips():
    os.mkdir("data")
    free = os.statvfs("/flash")[3]
    assert free == 189  # of 190, as a folder takes one
    with open("/flash/data/small", "wb") as small:
        small.write(bytes(100))
        with open("/flash/data/big", "wb") as file:
            try:
                for _ in range(400):
                    file.write(bytes(512))
                raise AssertionError("flash has no end")
            except OSError as error:
                assert error.args[0] == 28
        assert os.statvfs("/flash")[3] == 0
        small.write(bytes(412))  # its block has room
        try:
            small.write(b"x")
            raise AssertionError("another block")
        except OSError as error:
            assert error.args[0] == 28
    os.remove("data/big")
    for number in range(13):  # with "small" and the folder's own two: 16 entries fill a block
        open("/flash/data/%d.atm" % number, "wb").close()
    assert os.statvfs("/flash")[3] == free - 1
    open("/flash/data/long.atm.new", "wb").close()
    assert os.statvfs("/flash")[3] == free - 2
    for name in os.listdir("data"):
        if name != "small":
            os.remove("data/" + name)
    os.remove("data/small")
    assert os.statvfs("/flash")[3] == free
    assert os.listdir("/flash") == ["data"] and os.listdir("/") == ["flash"]
    assert [entry[0] for entry in os.ilistdir()] == ["data"]
    os.rmdir("data")
    try:
        os.stat("/elsewhere")
        raise AssertionError("outside the flash")
    except OSError as error:
        assert error.args[0] == 2


def write_aside(name, data, synced=True):
    """Write a file and rename it into its place."""
    with open(name + ".new", "wb") as file:
        file.write(data)
    if synced:
        os.sync()
    os.rename(name + ".new", name)


def case_power_cuts():
    operations = 5  # open, write, close, removal of the old one, rename
    states = []
    for cut in range(1, operations + 2):
        bare_board.start(flash=SCRATCH)
        for name in list(os.listdir()):
            if name.startswith("file"):
                os.remove(name)
        write_aside("file", b"old")
        bare_board.start(flash=SCRATCH, power_cut_at=cut)
        try:
            write_aside("file", b"newer")
            whole = True
        except Reset as reset:
            assert reset.cause == machine.PWRON_RESET
            whole = False
        assert whole == (cut > operations)
        state = {}
        for name in os.listdir():
            if name.startswith("file"):
                with open(name, "rb") as file:
                    state[name] = file.read()
        states.append(sorted(state.items()))
    aside = [("file", b"old"), ("file.new", b"")]
    wanted = [[("file", b"old")], aside, aside, [("file", b"old"), ("file.new", b"newer")],
              [("file.new", b"newer")], [("file", b"newer")]]  # fmt: skip
    assert states == wanted, states


def case_what_is_not_synced_is_lost_with_the_power():
    """Whatever its name is by then; what was synced lasts, and so does what others had before."""
    for synced in (True, False):
        bare_board.start(flash=SCRATCH)
        write_aside("file", b"old")
        bare_board.start(flash=SCRATCH, power_cut_at=6)
        write_aside("file", b"newer", synced)
        try:
            os.mkdir("folder")  # here the power fails
            raise AssertionError("no power cut")
        except Reset:
            pass
        with open("file", "rb") as file:
            assert file.read() == (b"newer" if synced else b""), synced
        os.remove("file")


for name in cases.wanted(globals()):
    bare_board.start(flash=SCRATCH + "/flash")
    globals()[name]()
    print(name)
