"""Users' programs on the program above the engine: what their calls do, and which are started."""

# all cases: slow on CPython

import asyncio  # before the stand-in of time: its loop has a clock of its own
import sys

import cases
import sequence_rig
import stand_in
from app_rig import state
from armtempo_shared import motion, program, sequence, wire
from program_rig import TABLE, World
from sequence_rig import ARM_CRC


def arrives(world):
    """A motion that moves ends at its target."""
    engine = world.board.engine
    if engine.moving:
        engine.steps = world.target()
        engine.finish()


def arrives_slowly(world):
    if world.turns % 20 == 0:
        arrives(world)


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


def case_without_a_host_texts_take_little_time():
    def script(world):
        if world.turns == 1:
            world.host.port.space = 0

    world = World("cell.sleep(1)\nfor i in range(20):\n    print(i)\n", script)
    assert world.start()[0] == "ok"
    try:
        world.execute()
    finally:
        world.host.port.space = 1 << 30
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


def case_a_pallet_goes_on_where_a_program_left_it():
    def script(world):
        if world.said() and world.said()[-1].startswith("row 1, column 1, layer 2"):
            world.host.ask("stop", (0,))

    world = World(
        "tray = cell.pallet('tray')\n"
        "while __at__(3) and tray.left():\n"
        "    print(tray.next())\n"
        "    cell.sleep(0.1)\n",
        script,
    )
    assert world.run()[0] == "stopped"
    places = ["row %d, column 1, layer %d of pallet 'tray'" % (n % 2 + 1, n // 2 + 1) for n in range(4)]
    assert world.said() == places[:3]
    world.script = lambda world: None
    for told in (["pallet 'tray' goes on at row 2, column 1, layer 2", places[3]], places):
        world.host.events.clear()
        assert world.start_stored()[0] == "ok"
        world.execute()
        assert (world.stands()[0], world.said()) == ("finished", told), world.said()
    assert set(world.board.taken.values()) == {0}
    world.board.taken = {("tray", 2, 1, 2): 1, ("far", 1, 1, 2): 1}  # of another shape
    world.host.events.clear()
    again = World("cell.pallet('far')\ntray = cell.pallet('tray')\ntray.reset()\nprint(tray.left())\n")
    again.board.taken = world.board.taken
    assert again.run()[0] == "finished"
    assert again.said() == ["pallet 'tray' goes on at row 2, column 1, layer 1", "4"], again.said()
    assert again.board.taken["tray", 2, 1, 2] == 0
    again.board.outputs = again.board.inputs = None
    assert again.host.upload("/arm", stand_in.arm(low=-1))[-1][0] == "ok"
    assert not again.board.taken


def tried(call):
    return "try:\n    cell.%s\nexcept cell.Error as error:\n    print(error)\n" % call


def case_what_is_not_possible_is_an_exception_with_words():
    calls, said = [], []
    for call, words in (
        ("goto('nowhere')", "the arm has no posture 'nowhere'; it has away, home, there"),
        ("goto('away')", "goto: joint 2 would leave its range"),
        ("goto([1, 2, 3])", "a posture has 2 angles, not 3"),
        ("goto(5)", "a posture has 2 angles, not 5"),
        ("goto([1, 'a'])", "a posture has 2 angles, not [1, 'a']"),
        ("goto([float('inf'), 0])", "a posture has 2 angles, not [inf, 0]"),
        ("goto('there', speed='fast')", "speed = 'fast' is not within 0.01 to 1"),
        ("set('gripper', None)", "output 'gripper': None is not within 0.0 to 1.0"),
        ("sleep('1')", "'1' s is not within 0 to 3600"),
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
        ("run('none')", "run('none') is refused: not_found"),
        ("goto({7, 7.5} - {7.5})", "a posture has 2 angles, not {7}"),
        ("goto(b'ab')", "a posture has 2 angles, not b'ab'"),
        ("wait(['part'])", "the name of the input is a text, not ['part']"),
        ("run(3)", "the name of the motion is a text, not 3"),
        ("count(None)", "the name of the counter is a text, not None"),
        ("pallet({})", "the name of the pallet is a text, not {}"),
        ("count('n' * 25)", "count: the name 'nnnnnnnnnnnnnnnnnnnnnnnnn' has not 1 to 24 bytes"),
    ):
        calls.append(tried(call))
        said.append(words)
    world = World("cell.tool('nothing')\n".join(calls))
    world.board.once.capacity = 100
    assert world.run()[0] == "finished"
    assert world.said() == said, world.said()
    assert not sequence_rig.runs(world.app) and not world.board.outputs.log
    world = World(tried("run('back')"))
    assert world.start()[0] == "ok"
    world.board.engine.refusal = (22,)
    world.execute()
    assert world.said() == ["run('back') is refused: wrong_start"]


def case_what_a_program_writes_is_in_the_flash_before_it_moves():
    world = World(
        "open('/dev/null').close()\ncell.goto('there')\nopen('/dev/null', 'w').close()\ncell.goto('home', wait=False)\n"
        "try:\n    open('/dev/null', 'a')\nexcept cell.Error as error:\n    print(error)\n",
        arrives_slowly,
    )
    assert world.start()[0] == "ok"
    synced = world.count_syncs()
    world.execute()
    assert world.stands()[0] == "finished"
    assert synced == [False], synced
    (said,) = world.said()
    assert said.startswith("open: '/dev/null': the flash cannot be written while the arm moves"), said


STILL_OPEN = """
import os
cell.goto('there', wait=False)
try:
    __still__(4, 'os.remove', os).remove('none')
except cell.Error as error:
    print(error)
cell.wait()
try:
    __still__(9, 'os.remove', os).remove('/none')
except OSError:
    print('none')
class File:
    closed = False
    def flush(self):
        if self.closed:
            raise ValueError
    def close(self):
        self.closed = True
file = File()
cell._files.append(('log', file))
try:
    cell.goto('home')
except cell.Error as error:
    print(error)
file.close()
cell.goto('home')
"""


def case_what_writes_to_the_flash_waits_for_rest():
    """Calls that the host has marked, and a file that is left open."""
    world = World(STILL_OPEN, arrives_slowly)
    assert world.start()[0] == "ok"
    synced = world.count_syncs()
    world.execute()
    assert synced == [False], synced
    said = world.said()
    assert said[0].startswith("os.remove: the flash cannot be written while the arm moves"), said
    assert said[1:] == ["none", "'log' is still open for writing: close it before the arm moves"], said
    assert world.stands()[0] == "finished"


PINS = """
class Pin:
    def name(self):
        return 'A15'
for free in 'PC12', 'C12', 12, -1, None:
    assert __free__(4, free) is free
for taken in 'PA15', 'A15', 2, Pin():
    try:
        __free__(6, taken)
    except cell.Error as error:
        print(error)
"""


def case_pins_and_timers_of_the_arm_are_refused():
    world = World(PINS, taken=["A15", "E7", 2, 5])
    assert world.start()[0] == "ok"
    world.execute()
    said = world.said()
    assert said == ["pin A15 is taken by the arm"] * 2 + ["timer 2 is taken by the arm", said[0]], said


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


def case_its_moves_have_memory_after_a_sequence():
    world = World("pass\n")
    world.board.once.release()
    assert world.start()[0] == "ok"
    assert len(world.board.once._data) == world.board.once.capacity
    world.execute()


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


def case_one_that_homes_the_arm_starts_before_that_and_moves_nothing_else():
    row = [0, -1, -990, -1000, 2000, 2050, 30, 30, 120, 1]
    plan = {
        "fast": TABLE["limits"],
        "slow": TABLE["limits"],
        "names": [["joint 1", "degrees"], ["joint 2", "degrees"]],
        "groups": [[row]],
    }
    world = World(
        "try:\n    cell.goto('there')\nexcept cell.Error as error:\n    print(error)\ncell.home()\n",
        homing=plan,
    )
    world.board.engine.known = 0
    assert world.start()[0] == "ok"
    world.board.engine.refusal = (
        wire.ERROR_CODES["unhomed"],
        0,
    )  # the engine's answer to a joint of unknown position
    world.execute()
    ending, _, line = world.stands()
    assert (ending, line) == ("fault", 6), (ending, line)
    assert world.said()[0] == "goto is refused: unhomed, joint 1", world.said()
    assert world.said()[1].endswith("home is refused: unhomed, joint 1"), world.said()
    assert not sequence_rig.runs(world.app) and world.board.engine.known == 0
    world.host.events.clear()
    for session, told in ((2, 1), (3, 1)):  # each host that comes learns it, until the fault is cleared
        assert world.host.hello(session)[0] == "ok"
        world.host.turn(5)
        assert len(world.said()) == told * (session - 1), world.said()
    assert world.host.ask("clear")[0] == "ok" and world.host.hello(4)[0] == "ok"
    world.host.turn(5)
    assert len(world.said()) == 2


cases.run(globals())
