"""The engine on simulated hardware: planned steps instead of a motion, every edge checked as it comes."""

import sys
from array import array

from arm_rows import HEAD, arm, row  # noqa: F401
from armtempo_board import points, stretch, walker
from virtual_board import machine_state, standalone
from virtual_board.arm import motors

TICK_HZ = 84_000_000
FEWER = 3 if "short" in sys.argv else 1
"""Repetitions are divided by it; the emulated interpreter is slow."""
SLOTS = stretch.STATE_SIZE - 13 * stretch.QUEUE_ROOM


class Steps:
    """Planned steps of a joint: (time of the first, ticks between two, number, direction) blocks in order."""

    def __init__(self, *blocks):
        self.blocks = blocks

    def at(self, place):
        """(time, direction) at a place [block, index], or None behind the last."""
        if place[0] == len(self.blocks):
            return None
        first, gap, _, direction = self.blocks[place[0]]
        return first + place[1] * gap, direction

    def go_on(self, place, steps=1):
        """Move a place on; not beyond the end of its block."""
        place[1] += steps
        if place[1] == self.blocks[place[0]][2]:
            place[0] += 1
            place[1] = 0

    def total(self):
        """Where all steps lead."""
        return sum([count * direction for _, _, count, direction in self.blocks])


class Motion:
    """What the engine is given instead of a motion; each joint's ``Steps``."""

    brake_ticks = 0

    def __init__(self, duration_ticks, *joints):
        self.duration = duration_ticks
        self.joints = joints


class Walker:
    """Takes the place of the evaluator's walker."""

    waits = walker.Walker.waits
    latest_k = walker.Walker.latest_k
    write = walker.Walker.write

    def __init__(self):
        self.ended = True
        self.at_turn = False
        self.direction = 1
        self.state = array("i", bytes(4 * stretch.STATE_SIZE))

    def lend(self):
        """Nothing to lend."""

    def load(self, motion, joint, position, pulse, gap):
        """Stand before the first step."""
        self._steps = motion.joints[joint]
        self._place = [0, 0]
        state = self.state
        state[stretch.PULSE] = pulse
        state[stretch.STEPS] = state[stretch.LATEST_1024] = 0
        state[stretch.OUT] = state[stretch.IN]
        self.at_turn = False
        first = self._steps.at(self._place)
        self.ended = first is None
        self.direction = 1 if first is None else first[1]

    def next_1024(self):
        """Time of the next step, in 1024 ticks."""
        return stretch.upcoming(self.state)

    def turn(self):
        """Go on in the other direction."""
        self.direction = -self.direction
        self.at_turn = False

    def prepare(self, until):
        """Queue steps as the evaluator's walker does: the first of a block by itself, the others in stretches."""
        self.state[stretch.UNTIL_1024] = until
        while not self.ended and not self.at_turn and stretch.wanted(self.state):
            time, direction = self._steps.at(self._place)
            if direction != self.direction:
                self.at_turn = True
                break
            _, gap, count, _ = self._steps.blocks[self._place[0]]
            steps = 1
            if self._place[1]:
                steps = max(1, min(count - self._place[1], 1024, (1 << 27) // gap))
            stretch.single(self.state, (time >> 12) + points.BIAS, time & 4095)
            if steps > 1:
                self._lengthen(time, gap, steps)
            self._steps.go_on(self._place, steps)
            self.ended = self._steps.at(self._place) is None

    def _lengthen(self, time, gap, steps):
        """The stretch queued last has so many steps, all as far apart."""
        state = self.state
        place = SLOTS + 13 * ((state[stretch.IN] - 1) % stretch.QUEUE_ROOM)
        base = (time - gap) & 0xFFFFFFFF
        base -= base >> 31 << 32
        words = (0, gap, 1 << 29, 1 << 29, 0, 0, base, 0, 0, 16, 0, steps, (time - gap) >> 10)
        for word, value in enumerate(words):
            state[place + word] = value
        state[stretch.LATEST_1024] = (time + (steps - 1) * gap) >> 10


class Pulses:
    """Listens to a joint's STEP and DIR pins and compares every edge with the plan."""

    def __init__(self, rig, joint, step, direction):
        self._rig = rig
        self._row = joint
        self._step = rig.board.pins.line(step)
        self._dir = rig.board.pins.line(direction)
        self._step.sinks.append(self)
        self._dir.sinks.append(self)
        self.expect(None)

    def expect(self, steps):
        """Begin a motion."""
        self._steps = steps
        self._place = [0, 0]
        self.rises = self.falls = 0
        self.net = 0
        self.last_rise = self.last_fall = self.last_turn = -(1 << 60)
        self.shortest_hold = self.shortest_setup = self.shortest_pulse = 1 << 60
        self.longest_pulse = 0

    def ignore(self):
        """Let every edge pass."""
        self._step.sinks.remove(self)
        self._dir.sinks.remove(self)

    def edges(self, line, before, count, times, origin):
        """A pin toggled."""
        for time in times:
            if line is self._step:
                if before:
                    self._fall(origin + time)
                else:
                    self._rise(origin + time)
            elif self._steps:
                self.last_turn = origin + time
                assert not self._step.level, "DIR turned within a pulse"
                self.shortest_hold = min(self.shortest_hold, self.last_turn - self.last_fall)
            before ^= 1

    def _rise(self, now):
        assert self._steps, "a step without a motion"
        planned = self._steps.at(self._place)
        assert planned, "a step too many"
        time, direction = planned
        assert now - self._rig.zero() == time, (now - self._rig.zero(), time, self.rises)
        assert (self._dir.level ^ self._row["dir_inverted"]) * 2 - 1 == direction, (time, direction)
        self._steps.go_on(self._place)
        self.shortest_setup = min(self.shortest_setup, now - self.last_turn)
        self.last_rise = now
        self.rises += 1
        self.net += direction

    def _fall(self, now):
        width = now - self.last_rise
        self.shortest_pulse = min(self.shortest_pulse, width)
        self.longest_pulse = max(self.longest_pulse, width)
        self.last_fall = now
        self.falls += 1

    def check_end(self, frozen=False):
        """All pulses are whole, and DIR kept its times. After a freeze the last pulse may be longer."""
        pulse = self._rig.head["pulse_ticks"]
        assert self.rises == self.falls, (self.rises, self.falls)
        assert self.shortest_pulse >= pulse, self.shortest_pulse
        assert frozen or self.longest_pulse <= pulse, self.longest_pulse
        assert self.shortest_hold >= self._rig.head["dir_hold_ticks"], self.shortest_hold
        assert self.shortest_setup >= self._rig.head["dir_setup_ticks"], self.shortest_setup

    def all_came(self):
        """Whether the whole plan was stepped."""
        return self._steps.at(self._place) is None


class Evaluator:
    """Takes the place of the evaluator's checks: every motion is fit."""

    refusal = None
    offset = 0
    Walker = Walker

    @staticmethod
    def check(motion, joints, gap_ticks, parts):
        """The refusal that a test has set."""
        return Evaluator.refusal

    @staticmethod
    def duration_ticks(motion):
        """As planned."""
        return motion.duration

    @staticmethod
    def start_offset(motion, joint, position_steps):
        """What a test has set."""
        return Evaluator.offset


class Rig:
    """A board, an arm, an engine. ``turn_us``: how long the main loop takes."""

    def __init__(self, joints, planned=True, turn_us=200, **head):
        self.head = dict(HEAD)
        self.head.update(head)
        self.joints = joints
        self.turn_ticks = 84 * turn_us
        self.samples = []
        self.board = standalone.start()
        self.board.observers.append(self)
        self._zero = 0
        import armtempo_board.check
        import armtempo_board.engine
        import armtempo_board.joint
        from armtempo_board import pins

        if planned:
            armtempo_board.joint.Walker = Walker
            armtempo_board.ends = Evaluator
            armtempo_board.check.check = Evaluator.check
            armtempo_board.engine.forget = lambda: None  # what stands in for the evaluator stays
        self.arm = machine_state.arm = motors.ArmOnPins(self.board, pins, lambda: (self.head, joints), 1, ())
        self.pins = pins
        self.pulses = [
            Pulses(self, joint, pins.STEP[joint["channel"]][0], pins.STEP[joint["channel"]][6])
            for joint in joints
        ]
        self.engine = armtempo_board.engine.Engine(self.head, joints)
        self.engine.home((1 << len(joints)) - 1, [0] * len(joints))

    # a world for the board

    def counting(self, timer, now):
        """TIM2 started: time 0 is when it comes round."""
        if timer.number == 2 and timer.running:
            self._zero = now + timer.modulus - timer.count(0)

    def passed(self, now):
        """Nothing to do."""

    def input_changed(self, line, level, now):
        """Nothing to do."""

    def zero(self):
        """Board time of the motion's time 0."""
        return self._zero

    def start(self, motion, homing=False):
        """Load and start a motion."""
        self.samples = []
        for pulses, steps in zip(self.pulses, motion.joints):
            pulses.expect(steps)
        refused = self.engine.load(motion)
        assert refused is None, refused
        self.engine.start(homing)

    def trusting(self):
        """The steps of this motion are not planned here: do not watch them."""
        for pulses in self.pulses:
            pulses.ignore()

    def turn(self):
        """One turn of the main loop."""
        self.engine.service()
        buffer = [0] * (2 + 2 * len(self.joints))
        while self.engine.next_sample(buffer):
            self.samples.append(list(buffer))
        self.board.spend(self.turn_ticks)

    def run_to(self, ticks):
        """Keep the main loop going until the motion's time is ``ticks``, or the motion ended."""
        while self.engine.moving and self.board.now < self._zero + ticks:
            self.turn()

    def run(self, motion):
        """A whole motion."""
        self.start(motion)
        self.run_to(motion.duration + TICK_HZ)
        self.turn()
        assert not self.engine.moving, "it does not end"

    def commanded(self):
        """Where the engine has its joints."""
        return [self.engine.commanded(number) for number in range(len(self.joints))]

    def stepped(self):
        """Where the pins have moved them."""
        return [pulses.net for pulses in self.pulses]


def cases(functions):
    """Run each of a script's cases, or those that the arguments name, and say its name."""
    wanted = [name for name in sys.argv[1:] if name != "short"]
    for function in functions:
        if not wanted or function.__name__ in wanted:
            function()
            print(function.__name__)
