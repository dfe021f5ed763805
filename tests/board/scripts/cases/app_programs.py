"""Users' programs on the program above the engine: what their calls do, and how they end."""

# all cases: slow on CPython

import asyncio  # before the stand-in of time: its loop has a clock of its own
import sys

import cases
import sequence_rig
import stand_in
from app_rig import connected, state
from armtempo_shared import motion, program, sequence, wire
from sequence_rig import ARM_CRC, LEGS, Inputs, Outputs

if sys.implementation.name == "cpython":
    import traceback

    sys.print_exception = lambda error, file: traceback.print_exception(error, file=file)
HEAD = "from armtempo_board import cell\n"
TABLE = {
    "file": "pick.py",
    "limits": [[1000, 4000, 20000], [1000, 4000, 20000]],
    "per_deg": [10.0, 20.0],
    "postures": {"home": [0, 0], "there": [10, 10], "away": [10, 100000]},
    "motions": {},
    "outputs": {"gripper": [1, 0.0, 1.0, {"open": 0, "closed": 65535}]},
    "inputs": {"part": 0},
    "counters": ["parts"],
    "pallets": {"tray": [2, 1, 2, {"": 0, "long": 4}], "far": [1, 1, 1, {"long": 8}]},
    "tools": {"long": {"there": [12, 12], "away": []}},
}
PLACES = [[10 * number, 20, 10 * number + 1, 21] for number in range(9)]


class World:
    """What goes on around a program: ``script`` is called with it in each turn of the loop."""

    def __init__(self, source, script=lambda world: None, legs=LEGS):
        self.app, self.host = connected()
        self.controller = self.app.controller
        self.board = self.controller.board
        self.board.outputs, self.board.inputs = Outputs(), Inputs()
        self.script = script
        self.turns = 0
        for name in sorted(legs):
            assert self.host.upload(name, legs[name])[-1][0] == "ok"
        table = dict(TABLE)
        table["motions"] = {name: wire.record_crc(legs[name]) for name in legs}
        self.data = program.pack(ARM_CRC, table, HEAD + source, PLACES)

    def start(self):
        """Store it and start it: the answer."""
        assert self.host.upload("pick", self.data)[-1][0] == "ok"
        return self.start_stored()

    def start_stored(self):
        return self.host.ask("start", (0, wire.record_crc(self.data)), "pick")

    def execute(self):
        """As the main loop does."""
        self.app.execute_program(self.turn)
        self.host.turn(5)

    def run(self):
        answer = self.start()
        assert answer[0] == "ok", answer
        self.execute()
        return self.stands()

    def turn(self):
        self.turns += 1
        assert self.turns < 20000, "it does not end"
        stand_in.Clock.now_ms += 1
        self.script(self)
        self.host.turn()

    def stands(self):
        kind, fields, name = self.host.ask("sequence")
        assert kind == "ok" and name in ("pick.py", b"pick.py"), name
        return sequence.ENDINGS[fields[0]], fields[1], fields[2]

    def said(self):
        return [tail for kind, _, tail in self.host.events if kind == "notice"]

    def target(self):
        """Where the move in memory ends, steps."""
        move = self.board.once.motion(self.board.store)
        points = [move.points(move.angle_offset(joint) + 8 * move.segments, 5) for joint in range(2)]
        weights = (1, 26, 66, 26, 1)
        sums = [sum([weight * point for weight, point in zip(weights, row)]) for row in points]
        return [(one + (60 << 28)) // (120 << 28) for one in sums]


def arrives(world):
    """A motion that moves ends at its target."""
    engine = world.board.engine
    if engine.moving:
        engine.steps = world.target()
        engine.finish()


def case_calls_do_what_they_say():
    world = World(
        'cell.goto("there")\n'
        "cell.set('gripper', 'closed', wait_s=0.3)\n"
        "cell.set('gripper', 0.25)\n"
        "print('at', cell.posture(), cell.count('parts'), cell.count('parts'), cell.count('others'))\n"
        "cell.goto([0.0, 0.26])\n"
        "print(cell.wait('part', timeout_s=0.5))\n",
        arrives,
    )
    begin_ms = stand_in.Clock.now_ms
    assert world.run() == ("finished", 0, 0)
    assert stand_in.Clock.now_ms - begin_ms >= 800  # both waits
    assert world.board.engine.steps == [0, 5]
    assert world.board.outputs.log == [(1, 65535), (1, 16384)]
    assert world.said() == ["at [1.0, 0.5] 1 2 1", "False"]
    assert sequence_rig.runs(world.app) == 2
    assert world.host.ask("counter", (1,))[1:] == ((2, 1), "others")
    assert state(world.host) == "idle"


def case_waits_end_after_days_too():
    def script(world):
        if world.turns == 1:
            stand_in.Clock.now_ms += (1 << 29) - 200

    world = World("cell.sleep(0.01)\ncell.sleep(1)\nprint(cell.wait('part', timeout_s=0.1))\n", script)
    assert world.run()[0] == "finished" and world.said() == ["False"]
    assert world.turns < 30, world.turns


def case_a_program_acts_while_a_motion_runs():
    def script(world):
        if world.turns == 5:
            world.board.inputs.levels = 1
        if world.turns == 40:
            world.board.engine.steps = [10, 10]
            world.board.engine.finish()

    world = World(
        'cell.start("there")\n'
        "assert cell.moving()\n"
        "assert cell.wait('part')\n"
        "cell.set('gripper', 'closed')\n"
        "assert not cell.wait(timeout_s=0.01) and cell.moving()\n"
        "cell.wait()\n"
        "assert not cell.moving() and cell.active('part')\n",
        script,
    )
    assert world.run() == ("finished", 0, 0)
    assert world.board.outputs.log == [(1, 65535)]
    assert world.turns >= 40


def case_an_exception_brakes_and_is_a_fault_with_its_line():
    def script(world):
        engine = world.board.engine
        if "brake" in engine.calls:
            engine.finish()

    world = World(
        "def pick():\n    cell.start('there')\n    cell.active('part')\n    return 1 // 0\n\npick()\n", script
    )
    ending, code, line = world.run()
    assert (ending, line) == ("fault", 5), (ending, line)
    assert wire.ERRORS[code][0] == "program_failed" and state(world.host) == "fault"
    (text,) = world.said()
    assert text.startswith('  File "pick.py", line 7') and "line 5, in pick" in text, text
    assert "ZeroDivisionError" in text and "cell.py" not in text, text
    assert world.start_stored()[:2] == ("error", "fault_pending")
    assert world.host.ask("clear")[0] == "ok"


def case_a_text_just_before_an_exception_does_not_hide_it():
    world = World("cell.sleep(0.2)\nprint('here')\n1 // 0\n")
    assert world.run()[0] == "fault"
    assert world.said()[0] == "here" and "ZeroDivisionError" in world.said()[1], world.said()


def case_without_a_host_texts_take_little_time():
    def script(world):
        if world.turns == 1:
            world.host.port.room = 0

    world = World("cell.sleep(1)\nfor i in range(20):\n    print(i)\n", script)
    assert world.start()[0] == "ok"
    try:
        world.execute()
    finally:
        world.host.port.room = 1 << 30
    assert world.stands()[0] == "finished"
    assert world.turns < 80, world.turns


def case_places_of_a_pallet_one_after_the_other_until_it_is_full():
    def script(world):
        if world.board.engine.moving:
            world.board.engine.finish()

    world = World(
        "tray = cell.pallet('tray')\n"
        "while tray.left():\n"
        "    place = cell.pallet('tray').next()\n"
        "    print(place, place.steps, place.above.steps)\n"
        "try:\n"
        "    tray.next()\n"
        "except cell.Error as error:\n"
        "    print(error)\n"
        "tray.reset(3)\n"
        "cell.tool('long')\n"
        "place = tray.next()\n"
        "print(place.above, place.steps, tray.left())\n"
        "cell.pallet('far').next()\n"
        "tray.reset()\n"
        "cell.tool('nothing')\n"
        "print(tray.next().steps)\n"
        "cell.goto(tray.next())\n",
        script,
    )
    assert world.run()[0] == "finished"
    assert sequence_rig.runs(world.app) == 1
    assert world.said() == [
        "row 1, column 1, layer 1 of pallet 'tray' [1, 21] [0, 20]",
        "row 2, column 1, layer 1 of pallet 'tray' [11, 21] [10, 20]",
        "row 1, column 1, layer 2 of pallet 'tray' [21, 21] [20, 20]",
        "row 2, column 1, layer 2 of pallet 'tray' [31, 21] [30, 20]",
        "pallet 'tray' has no place left; reset() begins again",
        "above row 2, column 1, layer 2 of pallet 'tray' [71, 21] 0",
        "[1, 21]",
    ], world.said()


def case_what_is_not_possible_is_an_exception_with_words():
    for call, words in (
        ("goto('nowhere')", "the arm has no posture 'nowhere'; it has away, home, there"),
        ("goto('away')", "goto: joint 2 would leave its range"),
        ("goto([1, 2, 3])", "a posture has 2 angles, not 3"),
        ("goto('there', speed=2)", "speed = 2 is not within 0.01 to 1"),
        ("set('gripper', 'shut')", "output 'gripper' has no state 'shut'; it has closed, open"),
        ("set('gripper', 2)", "output 'gripper': 2 is not within 0.0 to 1.0"),
        ("set('lamp', 1)", "the arm has no output 'lamp'; it has gripper"),
        ("wait('past')", "the arm has no input 'past'; it has part"),
        ("pallet('try')", "the program's text has no pallet 'try'; it has far, tray"),
        ("pallet('far').next()", "pallet 'far' cannot be reached with tool 'nothing'"),
        ("pallet('tray').reset(5)", "pallet 'tray' has no 5 places"),
        ("tool('short')", "the program's text has no tool 'short'; it has long"),
        ("tool('long'); cell.goto('away')", "posture 'away' cannot be reached with tool 'long'"),
        ("sleep(-1)", "-1 s is not within 0 to 3600"),
        ("set('gripper', 'closed', wait_s=-1)", "-1 s is not within 0 to 3600"),
        ("goto([0.1, 0])", "goto is refused: too_long, 100"),
        ("run('back')", "run('back') is refused: wrong_start"),
        ("run('none')", "run('none') is refused: not_found"),
    ):
        world = World(
            "try:\n    cell.%s\nexcept cell.Error as error:\n    print(error)\n" % call,
        )
        if "back" in call:
            assert world.start()[0] == "ok"
            world.board.engine.refusal = (22,)
            world.execute()
        else:
            if "0.1" in call:
                world.board.once.capacity = 100
            assert world.run()[0] == "finished", call
        assert world.said() == [words], (call, world.said())
        assert not sequence_rig.runs(world.app) and not world.board.outputs.log


def case_a_stop_ends_it_and_nothing_is_done_after():
    asked = []

    def script(world):
        if world.turns == 20:
            asked.append(world.host.ask("start", (0, 0), "there")[:2])
            asked.append(world.host.ask("put_once", (0, 9), b"")[:2])
            assert world.host.ask("stop", (0,))[0] == "ok"
        if world.turns == 30:
            world.board.engine.finish()

    world = World(
        "try:\n"
        "    cell.start('there')\n"
        "    while True:\n"
        "        try:\n"
        "            cell.active('part')\n"
        "        except Exception:\n"
        "            print('swallowed')\n"
        "finally:\n"
        "    cell.set('gripper', 'closed')\n",
        script,
    )
    assert world.run()[0] == "stopped"
    assert asked == [("error", "busy"), ("error", "busy")]
    assert not world.said() and not world.board.outputs.log
    assert world.turns == 30 and "brake" in world.board.engine.calls
    assert state(world.host) == "idle"


def case_marks_serve_a_loop_without_calls_and_tell_its_line():
    lines = []

    def script(world):
        if world.turns in (10, 100):
            lines.append(world.stands()[2])
        if world.turns == 120:
            world.host.ask("stop", (0,))

    world = World(
        "total = 0\n"
        "for i in __each__(3, range(800)):\n"
        "    total += i\n"
        "while __at__(5) and (True):\n"
        "    try:\n"
        "        total += 1\n"
        "    except:\n"
        "        pass\n",
        script,
    )
    assert world.run()[0] == "stopped"
    assert lines == [3, 5] and world.turns == 120, lines


def case_tasks_of_asyncio_run_while_the_arm_moves():
    def script(world):
        engine = world.board.engine
        if engine.moving and world.said():
            engine.steps = world.target()
            engine.finish()

    world = World(
        "import asyncio\n"
        "async def main():\n"
        "    task = asyncio.create_task(cell.serve())\n"
        "    cell.goto('there', wait=False)\n"
        "    for number in range(3):\n"
        "        await asyncio.sleep(0.002)\n"
        "    print('looked', number)\n"
        "    while cell.moving():\n"
        "        await asyncio.sleep(0)\n"
        "    task.cancel()\n"
        "asyncio.run(main())\n"
        "print('at', cell.posture())\n",
        script,
    )
    assert world.run()[0] == "finished"
    assert world.said() == ["looked 2", "at [1.0, 0.5]"], world.said()
    assert asyncio is sys.modules["asyncio"]


def case_the_hosts_speed_is_that_of_its_motions():
    rates = []

    def script(world):
        engine = world.board.engine
        if world.turns == 3:
            assert world.host.ask("speed", (500,))[0] == "ok"
        if engine.moving:
            rates.append(engine.rates.wanted)
            if len(rates) == 2:
                assert world.host.ask("speed", (400,))[0] == "ok"
                rates.append(engine.rates.wanted)
            engine.finish()

    world = World("cell.sleep(0.01)\ncell.run('there')\ncell.run('on', speed=0.5)\n", script)
    assert world.run()[0] == "finished"
    assert rates == [500, 250, 200], rates


def case_a_fault_of_the_board_ends_it():
    def script(world):
        if world.turns == 10:
            world.board.engine.fault = 40
            world.board.engine.finish()

    world = World("cell.run('there')\nprint('after')\n", script)
    ending, code, _ = world.run()
    assert (ending, code) == ("fault", 40) and not world.said()


def case_nothing_of_it_acts_after_its_end():
    world = World(
        "import cases, sys\nsys.modules['helper'] = cases\ncases.kept = cell\n"
        "cases.Ended = sys.modules['armtempo_board.app.cell'].Ended\n"
    )
    assert world.run()[0] == "finished"
    assert "helper" not in sys.modules and cases is sys.modules["cases"]
    assert not [name for name in sys.modules if name.endswith(("cell", "user_program", "rest_to_rest"))]
    assert not hasattr(sys.modules["armtempo_board.app"], "cell")
    for call in (lambda: cases.kept.goto("there"), lambda: cases.kept.set("gripper", "closed")):
        try:
            call()
            raise AssertionError("it acted")
        except cases.Ended:
            pass
    assert world.start_stored()[0] == "ok"  # what it needs is imported again
    world.execute()
    assert not sequence_rig.runs(world.app) and not world.board.outputs.log


def case_wrong_syntax_leaves_nothing():
    import armtempo_board

    ending, _, line = World("pass\nx = = 1\n").run()
    assert (ending, line) == ("fault", 3), (ending, line)
    assert not hasattr(armtempo_board, "cell")


def case_its_moves_have_memory_after_a_sequence():
    world = World("pass\n")
    world.board.once.release()
    assert world.start()[0] == "ok"
    assert len(world.board.once._data) == world.board.once.capacity
    world.execute()


def case_a_full_heap_ends_it():
    world = World("found = []\nwhile __at__(3):\n    found.append(bytearray(1 << 40))\n")
    ending, _, line = world.run()
    assert (ending, line) == ("fault", 4), (ending, line)
    text = world.said()[0]
    assert "MemoryError" in text or "OverflowError" in text, text


def case_a_pass_without_memory_is_the_programs_fault():
    """The program has filled the heap, and what the board's own work lacks is missing."""

    def script(world):
        engine = world.board.engine
        if "brake" in engine.calls:
            engine.finish()
        elif world.turns == 10:
            world.app.link.poll = full

    def full():
        del world.app.link.poll
        raise MemoryError

    world = World("cell.start('there')\nwhile True:\n    cell.moving()\n", script)
    ending, code, line = world.run()
    assert (ending, wire.ERRORS[code][0], line) == ("fault", "program_failed", 4), (ending, code, line)
    assert "brake" in world.board.engine.calls and "freeze" not in world.board.engine.calls
    assert "MemoryError" in world.said()[0]


def case_other_programs_than_the_stored_one_are_refused():
    world = World("pass\n")
    assert world.start()[0] == "ok"
    assert world.start_stored()[:2] == ("error", "busy")
    world.execute()
    assert world.host.ask("start", (0, 1), "pick")[1] == "bad_checksum"
    assert world.host.ask("start", (1, wire.record_crc(world.data)), "pick")[1] == "is_sequence"
    listed = [world.host.ask("list", (number,)) for number in range(5)]
    assert ("pick", 2) in [(tail, fields[-1]) for _, fields, tail in listed], listed
    other = program.pack(ARM_CRC ^ 1, TABLE, "pass\n")
    assert world.host.upload("pick", other)[-1][0] == "ok"
    assert world.host.ask("start", (0, wire.record_crc(other)), "pick")[1] == "arm_mismatch"
    damaged = bytearray(other)
    damaged[20] ^= 1
    assert world.host.upload("bad", bytes(damaged))[-1][1] == "bad_checksum"
    assert motion.MAGIC not in (program.MAGIC, sequence.MAGIC)


def case_the_button_starts_it_but_not_before_homing():
    from armtempo_board.errors import Refused

    def script(world):
        if world.turns == 30:
            world.controller.stop(0)

    world = World("print('begins')\nwhile True:\n    cell.active('part')\n", script)
    assert world.host.upload("pick", world.data)[-1][0] == "ok"
    assert world.host.ask("set_default", (), "pick")[0] == "ok"
    world.board.engine.known = 0
    assert world.host.ask("start", (0, wire.record_crc(world.data)), "pick")[1] == "unhomed"
    try:
        world.controller.begin(world.board.store().default(), 0)
        raise AssertionError("not refused")
    except Refused as refused:
        assert wire.ERRORS[refused.code][0] == "unhomed"
    assert not world.controller.moving() and world.controller.program is None
    world.board.engine.known = 3
    world.app.commands.greeted = False  # no host has ever been there
    world.controller.begin(world.board.store().default(), 0)
    world.execute()
    assert not world.app.events.notice and not world.said()  # nothing of it for the next host
    world.app.commands.greeted = True
    assert world.stands()[0] == "stopped" and world.turns == 30


def case_what_a_lost_host_was_not_told_gives_way_to_the_traceback():
    def script(world):
        world.app.link.room = lambda size: False

    world = World("print('one')\nprint('two')\n1 // 0\n", script)
    assert world.start()[0] == "ok"
    world.host.turn = lambda times=1: [world.app.run_once() for _ in range(times)]
    world.execute()
    assert b"ZeroDivisionError" in world.app.events.notice, world.app.events.notice


cases.run(globals())
