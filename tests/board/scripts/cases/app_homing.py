"""Homing by switches in a user's program, with joints that are only numbers."""

import stand_in

stand_in.install()

import cases  # noqa: E402
from armtempo_board.app import homing  # noqa: E402
from armtempo_board.app.cell import CellError  # noqa: E402
from armtempo_shared.messages import NO_JOINT, OTHER_SWITCH  # noqa: E402

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

    def __init__(self, stands, trips=TRIPS, pressed=(), shift=0, disturbed=()):
        self.table = {"postures": {"home": HOME}, "per_deg": [10, 10]}
        self.stands = list(stands)
        self.trips = list(trips)
        self.pressed = pressed  # whose switches are pressed everywhere
        self.shift = shift  # by which the switches trip later in the second approach
        self.disturbed = list(
            disturbed
        )  # after so many steps of moves that seek, joint 2's input trips for a moment
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

    def move_homing(self, start, target, limits, seeks):
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
        before = [self.is_pressed(joint) for joint in range(2)]
        disturbed = self.disturbed.pop(0) if seeks and self.disturbed else -1
        for passed in range(10000):
            for joint in range(2):
                way = target[joint] - self.counted[joint]
                if self.is_pressed(joint):
                    if way and (joint == 0) == (way < 0):
                        return joint
                    if seeks and not before[joint]:
                        return joint | OTHER_SWITCH
            if passed == disturbed:
                return 1 | OTHER_SWITCH
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
    names = [["joint 1", "degrees"], ["rail", "mm"]]
    groups = groups or [[row] for row in rows(TRIPS)]
    homing.home(arm, {"fast": "fast", "slow": "slow", "groups": groups, "names": names})
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
        (Arm((0, 0), (None, 450)), None, "joint 1: no limit switch tripped within 405 degrees", 0),
        (Arm((0, 0), (None, None)), [rows()], "joint 1", 0),
        (Arm((0, 0), pressed=(0,)), None, "joint 1: its limit switch is still pressed 12 degrees", 0),
        (Arm((0, 0), pressed=(1,)), None, "rail: its limit switch is still pressed 12 mm away", 1),
        (Arm((0, 0), shift=-20), None, "joint 1: its limit switch tripped 5.00 degrees after", 0),
    ):
        said = refused(arm, groups)
        assert said.startswith("home: " + words), said
        assert arm.known == known, said


class Swapped(Arm):
    """The switch of each joint is on the input of the other one."""

    def is_pressed(self, joint):
        return Arm.is_pressed(self, 1 - joint)


def case_the_switch_of_another_joint_in_its_place_ends_it():
    for stands in ((0, 0), (-900, 0), (2990, -1990), (-940, 0)):
        arm = Swapped(stands)
        said = refused(arm)
        assert said.startswith(
            "home: joint 1: the switch of rail tripped in the place of its limit switch"
        ), said
        assert (arm.known, arm.stands[0]) == (0, TRIPS[0]), said


def case_the_switch_of_the_other_end_in_its_place_ends_it():
    """Both its switches on each other's inputs, or its motor turns the other way."""

    class Turned(Arm):
        """Joint 1 has a switch at its high end too, at which it is stopped in both directions, or which it leaves."""

        def __init__(self, stands, is_at_high):
            Arm.__init__(self, stands, (None, 450))
            self.is_at_high = is_at_high

        def move_homing(self, start, target, limits, seeks):
            if self.is_at_high(self.stands[0]) and target[0] > start[0]:
                self.counted = list(start)
                return 0
            if self.is_at_high(self.stands[0] - 500) and seeks and target[0] < start[0]:
                self.counted = [start[0] - 500, start[1]]
                self.stands[0] -= 500
                return OTHER_SWITCH
            return Arm.move_homing(self, start, target, limits, False)

    said = refused(Turned((0, 0), lambda stands: stands == -500))
    assert said.startswith("home: joint 1: the switch of its other end tripped in the place of"), said


def case_what_trips_once_beside_it_is_left_out():
    for moments in ((200,), (200, 5), (0, 200)):
        arm = homed(Arm((0, 0), disturbed=moments))
        assert (arm.stands, arm.counted, arm.known) == (HOME, HOME, 3), (moments, arm.stands, arm.counted)


def case_a_switch_that_trips_on_the_way_home_is_said():
    class Bent(Arm):
        def declare(self, mask, steps):
            Arm.declare(self, mask, steps)
            HOME[0] = -980

    try:
        said = refused(Bent((0, 0)))
    finally:
        HOME[0] = 0
    assert said.startswith("home: joint 1: a switch tripped on the way to its home posture"), said


cases.run(globals())
