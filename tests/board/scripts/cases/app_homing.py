"""Homing by switches in a user's program, with joints that are only numbers."""

import stand_in

stand_in.install()

import cases  # noqa: E402
from armtempo_board.app import homing  # noqa: E402
from armtempo_board.app.cell import CellError  # noqa: E402
from armtempo_shared.messages import NO_JOINT  # noqa: E402

RANGES = ((-1000, 3000), (-2000, 500))
TRIPS = (-950, 450)
HOME = [0, -300]
BACK, TOLERANCE = 30, 1


def rows(trips=TRIPS):
    """Joint 1 has its switch at the low end, joint 2 at the high end."""
    found = []
    for joint, ((low, high), trip, side) in enumerate(zip(RANGES, trips, (-1, 1))):
        edge = low if side < 0 else high
        outside = max(0, side * (trip - edge))
        span = high - low
        found.append(
            [joint, side, trip, edge, span, span + outside + 50, BACK + outside, BACK, 120, TOLERANCE]
        )
    return found


class Arm:
    """In the place of a program: joints that stand somewhere, and switches that trip at steps (None: never)."""

    def __init__(self, stands, trips=TRIPS, pressed=(), shift=0):
        self.table = {"postures": {"home": HOME}}
        self.stands = list(stands)
        self.trips = list(trips)
        self.pressed = pressed  # whose switches are pressed everywhere
        self.shift = shift  # by which the switches trip later in the second approach
        self.counted = [0, 0]
        self.known = 0
        self.moves = []

    def steps(self):
        return list(self.counted)

    def range_steps(self, joint):
        return RANGES[joint]

    def declare(self, mask, steps):
        self.known |= mask
        for joint in range(2):
            if mask >> joint & 1:
                self.counted[joint] = steps[joint]

    def move_homing(self, start, target, limits):
        for joint in range(2):
            low, high = RANGES[joint]
            assert low <= start[joint] <= high and low <= target[joint] <= high
            if self.known >> joint & 1:
                assert start[joint] == self.counted[joint], "it assumes what is known to be otherwise"
        self.moves.append((limits, [end - begin for begin, end in zip(start, target)]))
        self.counted = list(start)
        if limits == "slow":
            self.trips = [trip if trip is None else trip + self.shift for trip in self.trips]
            self.shift = 0
        for _ in range(10000):
            for joint in range(2):
                way = target[joint] - self.counted[joint]
                if way and (joint == 0) == (way < 0) and self.is_pressed(joint):
                    return joint
            if self.counted == target:
                return NO_JOINT
            for joint in range(2):
                way = target[joint] - self.counted[joint]
                if way:
                    self.counted[joint] += 1 if way > 0 else -1
                    self.stands[joint] += 1 if way > 0 else -1
        raise AssertionError("it does not arrive")

    def is_pressed(self, joint):
        trip = self.trips[joint]
        if joint in self.pressed:
            return True
        return trip is not None and (self.stands[joint] <= trip if joint == 0 else self.stands[joint] >= trip)


def homed(arm, groups=None):
    homing.home(arm, {"fast": "fast", "slow": "slow", "groups": groups or [[row] for row in rows(TRIPS)]})
    return arm


def refused(arm, groups=None):
    try:
        homed(arm, groups)
    except CellError as error:
        return str(error)
    raise AssertionError("not refused")


def case_from_anywhere_it_ends_at_home():
    one, other = rows()
    for stands in ((0, 0), (2990, -1990), (-948, 449), (-960, 480), (-1040, 530), (3020, -2020)):
        for groups in ([[one], [other]], [[other], [one]], [[one, other]]):
            arm = homed(Arm(stands), groups)
            assert (arm.stands, arm.counted, arm.known) == (HOME, HOME, 3), (stands, arm.stands, arm.counted)
            assert {limits for limits, _ in arm.moves} == {"fast", "slow"}
    arm = homed(Arm((0, 0)), [[one], [other]])
    alone = [ways for _, ways in arm.moves[: len(arm.moves) // 2]]
    assert all(way[1] == 0 for way in alone), "the other joint stands while the first is homed"


def case_a_switch_beyond_the_range_is_left_into_it():
    trips = (-1100, 600)
    arm = homed(Arm((0, 0), trips), [rows(trips)])
    assert (arm.stands, arm.counted) == (HOME, HOME), arm.stands


def case_what_a_switch_does_wrong_is_said_and_ends_it():
    for arm, groups, words, known in (
        (Arm((0, 0), (None, 450)), None, "no switch of joint 1 tripped", 0),
        (Arm((0, 0), (None, None)), [rows()], "no switch of joint 1", 0),
        (Arm((0, 0), pressed=(0,)), None, "the switch of joint 1 stays pressed", 0),
        (Arm((0, 0), pressed=(1,)), None, "the switch of joint 2 stays pressed", 1),
        (Arm((0, 0), shift=-20), None, "the switch of joint 1 tripped elsewhere", 0),
    ):
        said = refused(arm, groups)
        assert said.startswith("home: " + words), said
        assert arm.known == known, said


def case_a_switch_that_trips_on_the_way_home_is_said():
    class Bent(Arm):
        def declare(self, mask, steps):
            Arm.declare(self, mask, steps)
            HOME[0] = -980

    try:
        said = refused(Bent((0, 0)))
    finally:
        HOME[0] = 0
    assert said == "home: the switch of joint 1 tripped on the way home", said


cases.run(globals())
