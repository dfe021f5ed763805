"""The board by itself: button, LEDs, and the samples for a host that comes later.

Every case asserts, and its name is printed when it holds. Arguments: see ``whole_board.arguments``.
"""

# all cases: not emulated, not on CPython

import sys

import cases
import machine_state
import whole_board
from armtempo_shared import armrecord, meanings, wire

FLASHES, PROGRAM, HOME, *_ = whole_board.arguments()
STEADY_MS = 30
SEED = 20264


def ready(world, default="go"):
    """A homed board whose host is gone again."""
    yield from world.hello()
    yield from world.ask("set_default", (), default)
    yield from world.home(HOME)
    yield from world.wait(100)
    assert world.led() == "idle"


def tap(world):
    """Press the button and release it."""
    world.press()
    yield from world.wait(2 * STEADY_MS)
    world.press(0)
    yield from world.wait(2 * STEADY_MS)


def moved(world, runs):
    """So many runs in all, each there and back; nothing moves."""
    yield from world.wait(100)
    yield from world.still()
    yield from world.wait(300)
    assert not machine_state.board.timers[2].running
    status = yield from world.status()
    assert status["run"] == runs, status
    start = HOME if status["known"] else [0, 0, 0]
    assert [start[joint] + steps for joint, steps in enumerate(world.steps())] == status["steps"]


def unmoved(world, runs=0):
    """Nothing moves or has moved for a while."""
    before = world.steps()
    yield from world.wait(300)
    yield from moved(world, runs)
    assert world.steps() == before


def moves_when_pressed_anew(world, runs=0):
    """The button, held until now, does nothing when released; the next press starts a run."""
    world.press(0)
    yield from unmoved(world, runs)
    yield from tap(world)
    yield from moved(world, runs + 1)


def notices(world):
    """What the board has said in words since the last time."""
    words = [tail for kind, _, tail in world.events if kind == "notice"]
    world.events = [event for event in world.events if event[0] != "notice"]
    return words


def case_button_starts_the_default_and_a_host_fetches_its_samples(world):  # emulated, on CPython
    assert world.led() == "unhomed"
    yield from ready(world)
    yield from tap(world)
    assert world.led() == "moving"
    yield from world.still()
    yield from world.wait(50)
    assert world.led() == "idle"
    world.events.clear()
    yield from world.hello(2)
    status = yield from world.status()
    assert (status["run"], status["state"], status["samples_lost"]) == (1, "idle", 0)
    (first, kept), _ = yield from world.ask("samples", (0, 0))
    assert (first, kept) == (0, status["samples_kept"])
    assert kept > 10
    yield from world.ask("samples", (0, kept))
    yield from world.until(lambda: len(world.events) >= kept)
    assert [(kind, fields[1]) for kind, fields, _ in world.events] == [("sample", n) for n in range(kept)]
    last = world.events[-1]
    assert last[1][2] >= status["ticks"] - 1000
    assert [whole_board.to_int(last[2][8 * joint : 8 * joint + 4]) for joint in range(3)] == status["steps"]


def case_a_level_that_stays_starts_it_once(world):
    yield from ready(world)
    world.press()
    yield from world.wait(100)
    assert world.led() == "moving"
    yield from moved(world, 1)
    yield from unmoved(world, 1)
    yield from moves_when_pressed_anew(world, 1)


def case_before_homing_nothing_moves(world):
    yield from world.hello()
    yield from world.ask("set_default", (), "go")
    yield from world.wait(2 * STEADY_MS)
    world.press()
    yield from unmoved(world)
    told = notices(world)
    assert told == ["button: error %d" % wire.ERROR_CODES["unhomed"]], told
    yield from world.home(HOME)
    yield from unmoved(world)
    yield from moves_when_pressed_anew(world)


def case_while_the_arm_is_guided_by_hand_the_button_is_only_told(world):
    """As the host knows it: a notice that begins so, once for each press, and nothing starts."""
    yield from ready(world)
    yield from world.ask("drivers", (0,))
    notices(world)
    for _ in range(2):
        yield from tap(world)
        yield from world.wait(3 * STEADY_MS)
    told = notices(world)
    assert len(told) == 2 and all(text.startswith(meanings.BUTTON_NOTICE) for text in told), told
    status = yield from world.status()
    assert status["run"] == 0 and world.steps() == [0, 0, 0], status
    yield from world.ask("drivers", (1,))


def case_while_it_moves_the_button_does_nothing(world):
    """Pressed again on the way, for a moment or to beyond the end, in a run of its own or of the host's."""
    yield from ready(world)
    crc = wire.record_crc(whole_board.read(FLASHES + "/finish/armtempo/go.atm"))
    for run in (1, 3):
        if run == 1:
            yield from tap(world)
        else:
            yield from world.ask("start", (0, crc), "go")
        yield from world.wait(300)
        yield from tap(world)
        yield from world.wait(300)
        world.press()
        yield from moved(world, run)
        yield from unmoved(world, run)
        yield from moves_when_pressed_anew(world, run)


def case_with_a_fault_pending_nothing_moves(world):
    yield from ready(world)
    machine_state.board.crash = True
    yield from world.wait(50)
    assert world.led() == "fault"
    notices(world)
    world.press()
    yield from unmoved(world)
    assert world.led() == "fault"
    assert notices(world) == ["button: error %d" % wire.ERROR_CODES["fault_pending"]]
    yield from world.ask("clear")
    yield from unmoved(world)
    assert world.led() == "idle"
    world.press(0)
    yield from world.wait(100)
    yield from tap(world)
    yield from moved(world, 1)


def bounce(world, level, ms, numbers):
    """The contact goes to and fro before it stays at a level; each time for less than it takes to count."""
    end = machine_state.board.now + ms * whole_board.TICKS_PER_MS
    while machine_state.board.now < end:
        level = 1 - level
        world.press(level)
        yield from world.wait(numbers.randrange(1, STEADY_MS - 5))


def case_a_bouncing_button_starts_one_run(world):
    numbers = whole_board.Numbers(SEED)
    yield from ready(world)
    for run in range(1, 4):
        yield from bounce(world, 1, 60, numbers)
        world.press(1)
        yield from moved(world, run)
        yield from bounce(world, 0, 200, numbers)
        world.press(0)
        yield from unmoved(world, run)


def case_spikes_start_nothing(world):
    numbers = whole_board.Numbers(SEED + 1)
    yield from ready(world)
    for _ in range(20):
        world.press(1)
        yield from world.wait(numbers.randrange(1, STEADY_MS - 5))
        world.press(0)
        yield from world.wait(numbers.randrange(1, 100))
    yield from unmoved(world)


def case_no_default(world):
    yield from ready(world, "")
    yield from tap(world)
    yield from unmoved(world)
    assert notices(world) == ["button: error %d" % wire.ERROR_CODES["not_found"]]


def case_default_that_was_removed_or_renamed(world):
    data = whole_board.read(FLASHES + "/finish/armtempo/go.atm")
    yield from world.hello()
    yield from upload(world, "other", data)
    yield from ready(world, "other")
    yield from world.ask("rename", (5,), "otherthird")
    yield from tap(world)
    yield from moved(world, 1)
    yield from world.ask("remove", (), "third")
    yield from tap(world)
    yield from unmoved(world, 1)
    assert notices(world) == ["button: error %d" % wire.ERROR_CODES["not_found"]]
    yield from upload(world, "third", data)  # the default is a name: it stands for what has it
    yield from tap(world)
    yield from moved(world, 2)


def upload(world, name, data):
    yield from world.ask("put_begin", (len(data), wire.record_crc(data)), name)
    for at in range(0, len(data), 200):
        yield from world.ask("put_data", (at,), data[at : at + 200])
    yield from world.ask("put_commit", (wire.record_crc(data),))


def case_a_run_by_button_needs_no_host(world):  # on CPython
    """Although this arm record says that a host that falls silent stops a motion."""
    yield from world.hello()
    assert world.arm[0]["flags"] & armrecord.FLAG_STOP_ON_LINK_LOSS
    assert world.arm[0]["link_timeout_ms"] < 1500
    yield from ready(world)
    yield from world.wait(3000)
    yield from tap(world)
    yield from world.wait(world.arm[0]["link_timeout_ms"] * 3 // 2)
    assert world.led() == "moving"
    yield from moved(world, 1)


def case_button_starts_a_program_and_ends_it(world):  # not compiled
    """It moves, waits for its input, and goes on; the next press brakes it, the one after starts it anew."""
    yield from ready(world, "pick")
    yield from tap(world)
    yield from world.until(lambda: world.led() == "moving")
    yield from world.still()
    yield from world.until(lambda: world.steps() != [0, 0, 0])
    yield from world.wait(500)
    assert world.led() == "moving"  # it waits, and has not ended
    assert notices(world) == ["first", "second"]
    for _ in range(2):
        yield from tap(world)
        yield from world.until(lambda: world.led() == "idle")
        kept = world.steps()
        yield from world.wait(500)
        assert world.steps() == kept
        yield from tap(world)
        yield from world.until(lambda: world.led() == "moving")


def visited(world, name, places):
    """Run what is stored; how many of the places it comes to, one after the other."""
    crc = wire.record_crc(whole_board.read(FLASHES + "/pallet/armtempo/" + name + ".atm"))
    yield from world.ask("start", (0, crc), name)
    count = quiet = 0
    while quiet < 300:
        yield
        quiet = 0 if machine_state.board.timers[2].running else quiet + 1
        if (
            count < len(places)
            and [home + moved for home, moved in zip(HOME, world.steps())] == places[count]
        ):
            count += 1
    return count


def case_a_pallet_by_a_program_and_by_a_sequence(world):  # not compiled
    """By the pins: above each place, at it, above it again, and home at last."""
    yield from world.hello()
    yield from world.home(HOME)
    rows = whole_board.read(FLASHES + "/pallet/places").decode().split("\n")
    places = []
    for row in rows:
        steps = [int(each) for each in row.split(",")]
        places += [steps[:3], steps[3:], steps[:3]]
    for name in ("by-goto", "lines"):
        count = yield from visited(world, name, places)
        assert (count, world.steps()) == (len(places), [0, 0, 0]), (name, count, world.steps())
        status = yield from world.status()
        assert (status["state"], status["fault"]) == ("idle", ""), status


class Switches:
    """The low switches of the arm that homes itself: it stands at some steps, and inputs fall where they trip."""

    PINS = ("D8", "D9", "D10")

    def __init__(self, world, works=(1, 1, 1)):
        self.world = world
        self.trips = [int(steps) for steps in whole_board.read(FLASHES + "/alone/trips").decode().split(",")]
        self.stood = [trip + 150 for trip in self.trips]
        self.works = works
        self.moved = False
        self.look()

    def stands(self):
        return [stood + steps for stood, steps in zip(self.stood, self.world.steps())]

    def look(self):
        for pin, at, trip, works in zip(self.PINS, self.stands(), self.trips, self.works):
            whole_board.set_level(pin, int(at > trip or not works))

    def until_it_ends(self, ms=60_000):
        """Nothing is sent to the board; its switches do what they do, until no step was made for a second."""
        quiet = 0
        before = self.world.steps()
        while quiet < 1000:
            yield
            self.look()
            steps = self.world.steps()
            quiet = quiet + 1 if steps == before else 0
            self.moved = self.moved or steps != before
            before = steps
            ms -= 1
            assert ms, "it does not end"


def case_it_homes_itself_when_powered_and_runs_its_program(world):  # not compiled
    """Joint 2 first, then the others; where it is at last the pins say, too."""
    switches = Switches(world)
    yield from switches.until_it_ends()
    assert switches.moved
    yield from world.hello()
    status = yield from world.status()
    assert (status["state"], status["fault"], status["known"]) == ("idle", "", 7), status
    assert status["steps"] == switches.stands(), (status["steps"], switches.stands())
    assert all(steps > home for steps, home in zip(status["steps"], HOME)), status


def case_a_switch_that_never_trips_ends_it_in_words_when_powered(world):  # not compiled
    switches = Switches(world, (1, 0, 1))
    yield from switches.until_it_ends()
    assert switches.moved
    for session in (1, 2):
        yield from world.hello(session)
        status = yield from world.status()
        assert (status["state"], status["fault"], status["known"]) == ("fault", "program_failed", 0), status
        (told,) = notices(world)
        assert "line 2" in told and "joint 2: no limit switch tripped" in told, told
    steps = world.steps()
    yield from world.ask("clear")
    yield from switches.until_it_ends()
    assert world.steps() == steps


def case_with_its_button_held_at_power_up_it_does_not_move_when_powered(world):  # not compiled
    """Nor after a soft reset, nor with its E-stop pressed."""
    for session in (1, 2):
        yield from Switches(world).until_it_ends()
        yield from world.hello(session)
        status = yield from world.status()
        assert (status["run"], status["known"], world.steps()) == (0, 0, [0, 0, 0]), status
        world.press(0)
        if session == 1:
            yield from world.ask("leave")
            yield from world.until(lambda: world.attached)
            world.type(b"\x04")
            yield from world.until(lambda: not world.attached)
    whole_board.set_level("E15", 0)
    yield from world.wait(100)
    yield from tap(world)
    yield from Switches(world).until_it_ends()
    status = yield from world.status()
    assert (status["fault"], world.steps()) == ("estop", [0, 0, 0]), status


def case_level_present_at_power_up(world):
    yield from ready(world)
    yield from unmoved(world)
    assert notices(world) == []  # it is not even taken for a press
    yield from moves_when_pressed_anew(world)


def case_a_failing_start_is_a_fault_not_the_end(world):  # not compiled
    """The button's start raises something unforeseen: the program continues and says so."""
    yield from ready(world)
    sys.modules["armtempo_board.app.board"].Board.store = None
    yield from tap(world)
    status = yield from world.status()
    assert (status["fault"], world.led()) == ("internal", "fault")
    yield from unmoved(world)


for name in cases.wanted(globals()):
    held = (lambda world: world.press()) if "power_up" in name else None
    flash = "/stop" if "no_host" in name else "/alone" if "when_powered" in name else "/finish"
    flash = FLASHES + ("/pallet" if "pallet" in name else flash)
    whole_board.run(globals()[name], flash, PROGRAM, held)
    print(name)
