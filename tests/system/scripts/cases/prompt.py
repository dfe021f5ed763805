"""The prompt behind the program: who gets to it and when, replays typed there, and who feeds the watchdog.

Every case asserts, and its name is printed when it holds. Arguments: see ``whole_board.arguments``.
"""

# all cases: not emulated, not on CPython

import cases
import machine_state
import whole_board
from armtempo_shared import wire

FLASHES, PROGRAM, HOME, DURATION, _ = whole_board.arguments()
GO = whole_board.read(FLASHES + "/finish/armtempo/go.atm")
CONNECT = b"\r\x03"  # what mpremote sends first
BITE_MS = 8000
MOVES_TICKS = DURATION - 20_000_000
RUNNING = "import machine; print(machine.mem32[0x40003008] & 0xFFF != 0xFFF)"  # the watchdog's reload value
SEED = 20266


def prompt(world):
    """Leave the program as mpremote does it."""
    yield from world.until(lambda: not world.attached)
    yield from world.wait(200)
    world.printed = bytearray()
    world.type(CONNECT)
    yield from shown(world, b">>> ")


def shown(world, text, ms=5000):
    """Wait until the prompt's port has shown it; gives what came before and forgets it."""
    yield from world.until(lambda: text in world.printed, ms)
    at = world.printed.find(text) + len(text)
    before = bytes(world.printed[:at])
    world.printed = world.printed[at:]
    return before.decode()


def typed(world, line, ms=5000):
    """What a line typed at the prompt prints."""
    world.type(line.encode() + b"\r")
    yield from shown(world, line.encode() + b"\r\n")
    text = yield from shown(world, b">>> ", ms)
    return text[:-6]


def alive(world, ms):
    """No reset comes for so long."""
    board = machine_state.board
    yield from world.wait(ms)
    assert machine_state.board is board


def case_boot_leaves_a_serial_port_only(world):  # emulated
    yield from world.hello()
    assert machine_state.settings["usb_mode"] == "VCP"
    assert machine_state.settings["reset_cause"] == 1


def case_watchdog_runs_with_the_program_and_is_fed_at_the_prompt(world):
    yield from prompt(world)
    answer = yield from typed(world, RUNNING)
    assert answer == "True", answer
    yield from alive(world, 3 * BITE_MS)
    yield from typed(world, "import time; time.sleep(20)", 30_000)  # busy: it is fed from an interrupt


def case_soft_reset_without_the_program_is_fed_by_boot(world):
    """As ``mpremote`` does it: a soft reset in raw mode runs boot.py alone."""
    yield from prompt(world)
    world.type(b"\x01")
    yield from shown(world, b"raw REPL; CTRL-B to exit\r\n>")
    world.type(b"\x04")
    yield from shown(world, b"soft reboot\r\n")
    yield from shown(world, b"raw REPL; CTRL-B to exit\r\n>")
    yield from alive(world, 3 * BITE_MS)
    world.type(RUNNING.encode() + b"\x04")
    answer = yield from shown(world, b"\x04\x04>")
    assert answer == "OKTrue\r\n\x04\x04>", answer


def case_soft_reset_starts_the_program_again(world):
    yield from world.hello()
    yield from world.home(HOME)
    yield from prompt(world)
    world.type(b"\x04")
    yield from shown(world, b"soft reboot\r\n")
    yield from world.hello(2)
    status = yield from world.status()
    assert (status["state"], status["fault"], status["known"]) == ("unhomed", "", 0)
    yield from alive(world, 2 * BITE_MS)
    machine_state.board.lost_ticks = 1 << 50
    board = machine_state.board
    yield from world.until(lambda: machine_state.board is not board, 2 * BITE_MS)
    yield from world.hello(3)
    status = yield from world.status()
    assert status["fault"] == "watchdog"


def case_unfed_it_bites_at_the_prompt(world):
    yield from prompt(world)
    yield from typed(world, "import pyb; pyb.Timer(7).deinit()")
    board = machine_state.board
    yield from world.until(lambda: machine_state.board is not board, 2 * BITE_MS)
    yield from world.hello()
    status = yield from world.status()
    assert status["fault"] == "watchdog"


def case_broken_program_has_a_prompt_without_watchdog(world):
    """The watchdog starts with the loop, so what fails before can be repaired in peace."""
    yield from shown(world, b"ValueError: broken")
    yield from shown(world, b">>> ")
    answer = yield from typed(world, RUNNING)
    assert answer == "False", answer
    yield from alive(world, 3 * BITE_MS)


def case_nobody_gets_to_the_prompt_while_it_moves(world):
    numbers = whole_board.Numbers(SEED)
    yield from world.hello()
    for words in (CONNECT, b"\r\x03\r\x01", b"\x03\x03\x03", b"\r\x03\x03\r\x01print(1)\x04", b"\x04"):
        yield from world.home(HOME)
        before = world.steps()
        yield from world.ask("start", (0, wire.record_crc(GO)), "go")
        while machine_state.board.now < world.zero + MOVES_TICKS:
            world.type(words)
            yield from world.wait(numbers.randrange(100, 300))
            assert not world.attached, words
        yield from world.still()
        yield from world.wait(100)
        assert not world.attached, words
        status = yield from world.status()
        assert (status["state"], status["fault"], status["steps"]) == ("idle", "", HOME), status
        assert world.steps() == before
    yield from prompt(world)


def case_the_program_goes_on_where_it_was_left(world):
    """Called again at the prompt: position, samples and the rest are still there."""
    yield from world.hello()
    yield from world.home(HOME)
    yield from world.ask("start", (0, wire.record_crc(GO)), "go")
    yield from world.still()
    yield from prompt(world)
    world.type(b"from armtempo_board import start; start()\r")
    yield from world.hello(2)
    status = yield from world.status()
    assert (status["state"], status["run"], status["steps"]) == ("idle", 1, HOME)
    assert status["samples_kept"] > 10
    yield from alive(world, 2 * BITE_MS)


def case_replay_typed_at_the_prompt(world):  # on CPython
    """From the posture that the arm has; again; and what it says of names and faults."""
    yield from prompt(world)
    before = world.steps()
    yield from typed(world, "import armtempo_board")
    answer = yield from typed(world, "armtempo_board.replay('go')", 10_000)
    assert answer == "taking the posture of the arm as the start of go\r\ndone at steps %s" % HOME, answer
    assert world.steps() == before
    answer = yield from typed(world, "armtempo_board.replay('go')", 10_000)
    assert answer == "done at steps %s" % HOME, answer
    answer = yield from typed(world, "armtempo_board.replay()")
    assert answer.split() == ["refused:", "not_found"], answer
    yield from alive(world, 2 * BITE_MS)


def case_ctrl_c_stops_a_replay_wherever_it_comes(world):  # not compiled, slow
    """Once: it brakes along the path; twice: it freezes. The steps are those on the pins, and the prompt is back."""
    numbers = whole_board.Numbers(SEED)
    yield from world.hello()
    yield from world.home(HOME)
    yield from prompt(world)
    yield from typed(world, "import armtempo_board")
    yield from typed(world, "program = armtempo_board.load_program()")
    for number in range(12):
        declared = world.steps()
        yield from typed(world, "program.app.controller.home(7, %s)" % HOME)
        world.type(b"armtempo_board.replay('go')\r")
        yield from world.until(lambda: machine_state.board.timers[2].running)
        yield from world.wait(numbers.randrange(0, 2300))
        running = machine_state.board.timers[2].running
        # KeyboardInterrupt could come anywhere
        assert machine_state.serial.interrupt_char == -1 or not running
        world.type(b"\x03")
        if number & 1:
            yield from world.wait(numbers.randrange(1, 300))
            world.type(b"\x03")
        yield from world.still()
        answer = yield from shown(world, b">>> ")
        made = [now - before for now, before in zip(world.steps(), declared)]
        steps = [home + step for home, step in zip(HOME, made)]
        assert not running or "done at steps %s\r\n" % steps in answer, (answer, steps)
        yield from world.wait(100)
        world.printed = bytearray()


def case_a_program_at_the_prompt_prints_there(world):  # not compiled
    """Homed, as a motion; Ctrl-C ends it."""
    yield from prompt(world)
    yield from typed(world, "import armtempo_board")
    answer = yield from typed(world, "armtempo_board.replay('pick')")
    assert answer.split() == ["refused:", "unhomed", "joint", "1"], answer
    yield from typed(world, "program = armtempo_board.load_program()")
    yield from typed(world, "program.app.controller.home(7, %s)" % HOME)
    world.type(b"armtempo_board.replay('pick')\r")
    yield from shown(world, b"first\r\nsecond\r\n", 10_000)
    world.type(b"\x03")
    answer = yield from shown(world, b">>> ")
    made = [home + steps for home, steps in zip(HOME, world.steps())]
    assert answer == "done at steps %s\r\n>>> " % made, answer


for name in cases.wanted(globals()):
    flash = FLASHES + ("/broken" if "broken" in name else "/finish")
    whole_board.run(globals()[name], flash, PROGRAM)
    print(name)
