"""How the program starts, though records of its flash are damaged, and is left for MicroPython's prompt."""

# all cases: slow on CPython

import struct
import sys

import cases
import stand_in

from app_rig import ROOT, App, connected, start  # isort: skip  it puts the stand-ins into place

from armtempo_board import prompt
from armtempo_board.app import board
from armtempo_shared import armrecord, engine_memory, wire
from stand_in import Clock, Port

NUMBER = [0]
ARM_CRC, PROBLEM, VALUE = 9, -3, -2


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


def case_no_record_is_no_problem():  # not emulated
    assert started(folder_with(stand_in.arm()))[2][PROBLEM] == 0
    assert started(ROOT + "-none")[2][PROBLEM] == 0


def case_damaged_records_are_named():  # not emulated
    arm = stand_in.arm()
    for broken in (b"", arm[:7], arm[:-1], arm[:-4] + b"abcd", b"x" * 300):
        names_it(broken, "bad_record")


def case_another_version_is_named():  # not emulated
    arm = bytearray(stand_in.arm()[:-4])
    arm[4] = armrecord.VERSION_WITH_OUTPUTS + 1
    names_it(with_crc(bytes(arm)), "bad_record")


def case_what_the_board_has_not_is_named():  # not emulated
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

    size = engine_memory.needed_bytes([1])
    is_short = True


def case_a_record_that_no_longer_fits_is_named():  # not emulated
    arm = stand_in.arm()
    root = folder_with(arm)
    memory_shares = sys.modules["armtempo_board.app.memory_shares"]
    memory_shares.for_engine, before = Cramped, memory_shares.for_engine
    try:
        _, host, hello = started(root)
    finally:
        memory_shares.for_engine = before
    needed = engine_memory.needed_bytes([1, 1])
    assert (wire.ERRORS[hello[PROBLEM]][0], hello[VALUE]) == ("no_engine_memory", needed)
    small = stand_in.arm(joints=1)
    assert host.upload("/arm", small)[-1] == ("ok", (), b"")
    assert host.upload("/arm", arm)[-1] == ("error", "no_engine_memory", 255, needed)
    assert host.hello()[1][ARM_CRC] == wire.record_crc(small)
    with open(root + "/arm.ata", "rb") as file:
        assert file.read() == small, "what does not fit does not take the old one's place"


def case_an_engine_that_cannot_be_made_is_named():  # not emulated
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


def case_a_damaged_motion_is_listed_and_refused():  # not emulated
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


CTRL_C = b"\r\x03\r\x01"
"""What mpremote begins with."""


def leaves_by_ctrl_c(app, host):
    """Within a few turns; what comes after is left to the prompt."""
    host.port.inbox.extend(CTRL_C)
    for _ in range(10):
        if not app.leave_requested():
            host.turn(1)
    assert app.leave_requested()
    assert bytes(host.port.inbox) == b"\x01"


def case_repl_is_reached_by_ctrl_c_when_idle_only():  # not emulated
    app, host = connected()
    start(host)
    host.turn(1000)
    host.port.inbox.extend(CTRL_C)
    host.turn(1000)
    assert not app.leave_requested()
    app.controller.board.engine.finish()
    host.turn(1000)
    assert not app.leave_requested()
    leaves_by_ctrl_c(app, host)


def case_noise_does_not_open_the_repl():  # not emulated
    app, host = connected()
    host.turn(1000)
    for noise in (b"\r\r\r\r", b"x\x03\x03\r", b"\x03", b"\xa5\x03\x00\x03\x03\x03\x03", b"\n\r\x03"):
        host.port.inbox.extend(noise)
        host.turn(40)
        host.port.inbox.extend(wire.frame(1, 2, b""))
        host.turn(1000)
        assert not app.leave_requested(), noise


def case_line_ends_alone_do_not_open_the_repl():  # not emulated
    """A terminal's Enter, before the first frame and after one."""
    for clear in (False, True):
        request = prompt.PromptRequest()
        if clear:
            request.clear()
        assert not any([request.comes(byte, 1000) for byte in b"\r\r\r\r"]), clear
        assert request.comes(3, 1000)


def case_repl_is_reached_right_behind_a_frame():  # not emulated
    """A host program that starts mpremote; the port's buffer may hold both."""
    app, host = connected()
    host.turn(1000)
    host.send("status")
    leaves_by_ctrl_c(app, host)


def case_leave_answers_first():  # not emulated
    app, host = connected()
    assert host.ask("leave") == ("ok", (), b"")
    assert app.leave_requested()


class Here:
    """In the place of ``os`` and ``time``."""

    terminals = []

    def dupterm(self, port, index):
        self.terminals.append(port)

    def ticks_ms(self):
        Clock.now_ms += 1
        return Clock.now_ms

    def ticks_diff(self, end, start):
        return end - start

    def sleep_ms(self, wait_ms):
        """Time continues by itself."""


def case_a_program_that_ended_by_itself_lets_no_frame_reach_the_prompt():  # not emulated
    port = Port()
    frames = b"".join([wire.frame(number, 4, bytes((3, 3, 13, 4))) for number in range(200)])
    assert b"\x04" in frames and b"\x03" in frames
    port.inbox.extend(frames + bytes(16))
    sys.modules["pyb"].USB_VCP = lambda: port
    prompt.os = prompt.time = Here()
    asked = []
    read = port.readinto

    def readinto(buffer, count):
        if not port.inbox and not asked:  # all frames are gone; now mpremote comes, after quiet
            Clock.now_ms += 100
            asked.append(1)
            port.inbox.extend(CTRL_C)
        return read(buffer, count)

    port.readinto = readinto
    prompt.wait()
    assert asked and bytes(port.inbox) == b"\x01", port.inbox
    assert Here.terminals == [None, port]


def case_begun_again_it_waits_for_a_greeting():  # not emulated
    app, host = connected()
    host.ask("leave")
    app.enter()
    assert not app.leave_requested()
    assert host.ask("status")[:2] == ("error", "no_session")
    assert host.hello()[0] == "ok"
    assert host.ask("status")[0] == "ok"


cases.run(globals())
