"""The engine on simulated hardware: planned steps instead of a motion, every edge checked as it comes."""

import sys
from array import array

import bare_board
import machine_state
from arm import motors
from arm_rows import HEAD, arm, row  # noqa: F401
from armtempo_board.errors import Refused
from armtempo_board.stepgen import bezier, step_generator, step_queue

TICK_HZ = 84_000_000
FEWER = 6 if "short" in sys.argv else 1
"""Repetitions are divided by it; the emulated interpreter is slow."""
ITEM_WORDS = 12
SLOTS = step_queue.QUEUE_SIZE - ITEM_WORDS * step_queue.CAPACITY


class Steps:
    """Planned steps of a joint: (time of the first, ticks between two, number, direction) blocks in order."""

    def __init__(self, *blocks):
        self.blocks = blocks

    def at(self, place):
        """(time, direction) at a place [block, index], or None after the last."""
        if place[0] == len(self.blocks):
            return None
        first, gap, _, direction = self.blocks[place[0]]
        return first + place[1] * gap, direction

    def advance(self, place, steps=1):
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

    can_brake = False

    def __init__(self, duration_ticks, *joints):
        self.duration = duration_ticks
        self.joints = joints


class StepGenerator:
    """Takes the place of the evaluator's generator."""

    waits = step_generator.StepGenerator.waits
    latest_kiticks = step_generator.StepGenerator.latest_kiticks
    write = step_generator.StepGenerator.write

    halted = False

    def __init__(self, memory):
        self.ended = True
        self.at_reversal = False
        self.direction = 1
        self.queue = array("i", bytes(4 * step_queue.QUEUE_SIZE))

    subintervals = None

    def close(self):
        """There is no file."""

    def load(self, motion, joint, position, pulse, gap, moves=1):
        """Stand before the first step."""
        self._steps = motion.joints[joint]
        self._end_steps = position + self._steps.total()
        self._place = [0, 0]
        state = self.queue
        state[step_queue.PULSE] = pulse
        state[step_queue.STEPS] = state[step_queue.LATEST_KITICKS] = 0
        state[step_queue.OUT] = state[step_queue.IN]
        self.at_reversal = False
        first = self._steps.at(self._place)
        self.ended = first is None
        self.direction = 1 if first is None else first[1]

    def next_kiticks(self):
        """Time of the next step, in 1024 ticks."""
        return step_queue.next_kiticks(self.queue)

    def end_steps(self, at_rest):
        """Where the plan leads."""
        return self._end_steps

    def reverse(self):
        """Continue in the other direction."""
        self.direction = -self.direction
        self.at_reversal = False

    def prepare(self, until):
        """Queue steps as the evaluator's does: the first of a block by itself, the others as cubics."""
        while step_queue.has_space(self.queue, until) and not self.ended and not self.at_reversal:
            time, direction = self._steps.at(self._place)
            if direction != self.direction:
                self.at_reversal = True
                break
            _, gap, count, _ = self._steps.blocks[self._place[0]]
            steps = 1
            if self._place[1]:
                steps = max(1, min(count - self._place[1], 1024, (1 << 27) // gap))
            step_queue.put_single(self.queue, (time >> 12) + bezier.BIAS, time & 4095)
            if steps > 1:
                self._lengthen(time, gap, steps)
            self._steps.advance(self._place, steps)
            self.ended = self._steps.at(self._place) is None

    def _lengthen(self, time, gap, steps):
        """The item queued last has that many steps, all as far apart."""
        state = self.queue
        place = SLOTS + ITEM_WORDS * ((state[step_queue.IN] - 1) % step_queue.CAPACITY)
        base = (time - gap) & 0xFFFFFFFF
        base -= base >> 31 << 32
        words = (0, gap, 1 << 29, 1 << 29, 0, 0, base, 0, 0, 1, (time - gap) >> 10, steps)
        for word, value in enumerate(words):
            state[place + word] = value
        state[step_queue.LATEST_KITICKS] = (time + (steps - 1) * gap) >> 10


class Pulses:
    """Listens to a joint's STEP and DIR pins and compares every edge with the plan."""

    def __init__(self, rig, joint, step, direction):
        self._rig = rig
        self._inverted = joint["dir_inverted"]
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
        # of every step of every case: no calls
        steps = self._steps
        assert steps, "a step without a motion"
        place = self._place
        assert place[0] < len(steps.blocks), "a step too many"
        first, gap, count, direction = steps.blocks[place[0]]
        time = first + place[1] * gap
        assert now - self._rig._zero == time, (now - self._rig._zero, time, self.rises)
        assert (self._dir.level ^ self._inverted) * 2 - 1 == direction, (time, direction)
        place[1] += 1
        if place[1] == count:
            place[0] += 1
            place[1] = 0
        setup = now - self.last_turn
        if setup < self.shortest_setup:
            self.shortest_setup = setup
        self.last_rise = now
        self.rises += 1
        self.net += direction

    def _fall(self, now):
        width = now - self.last_rise
        if width < self.shortest_pulse:
            self.shortest_pulse = width
        if width > self.longest_pulse:
            self.longest_pulse = width
        self.last_fall = now
        self.falls += 1

    def check_end(self):
        """All pulses are whole and none is longer, also the last one before a freeze; and DIR kept its times."""
        pulse = self._rig.head["pulse_ticks"]
        assert self.rises == self.falls, (self.rises, self.falls)
        assert self.shortest_pulse >= pulse, self.shortest_pulse
        assert self.longest_pulse <= pulse, self.longest_pulse
        assert self.shortest_hold >= self._rig.head["dir_hold_ticks"], self.shortest_hold
        assert self.shortest_setup >= self._rig.head["dir_setup_ticks"], self.shortest_setup

    def all_came(self):
        """Whether the whole plan was stepped."""
        return self._steps.at(self._place) is None


class Evaluator:
    """Takes the place of the evaluator's checks: every motion is fit."""

    refusal = None
    offset = 0
    StepGenerator = StepGenerator

    @staticmethod
    def check(motion, joints, gap_ticks, parts):
        """The refusal that a test has set."""
        if Evaluator.refusal:
            raise Refused(*Evaluator.refusal)
        return 0xFF

    @staticmethod
    def duration_ticks(motion):
        """As planned."""
        return motion.duration

    @staticmethod
    def start_offset(motion, joint, position_steps):
        """What a test has set."""
        return Evaluator.offset


class Rig:
    """A board, an arm, an engine. ``turn_us``: how long the main loop takes; ``backlash``: as of ``EngineParts``."""

    def __init__(self, joints, planned=True, turn_us=1000, backlash=(), **head):
        self.head = dict(HEAD)
        self.head.update(head)
        self.joints = joints
        self.turn_ticks = 84 * turn_us
        self.samples = []
        self.board = bare_board.start()
        self.board.observers.append(self)
        self._zero = 0
        from armtempo_board.hardware import pins
        from armtempo_board.motion import engine, joint_drive, motion_check

        if planned:
            joint_drive.StepGenerator = StepGenerator
            engine.endpoints = Evaluator
            motion_check.check = Evaluator.check
        self.arm = machine_state.arm = motors.ArmOnPins(self.board, pins, lambda: (self.head, joints), 1, ())
        self.pins = pins
        self.pulses = [
            Pulses(self, joint, pins.STEP[joint["channel"]][0], pins.DIR[joint["channel"]])
            for joint in joints
        ]
        self.engine_memory = self._engine_memory()
        self.make_engine(joints, backlash)
        self.engine.home((1 << len(joints)) - 1, [0] * len(joints))

    def make_engine(self, joints, backlash=()):
        """The engine for the rig's head and these joints."""
        from armtempo_board.motion.engine import Engine
        from armtempo_board.motion.engine_parts import EngineParts

        self.engine = Engine(EngineParts(self.head, joints, self.engine_memory, backlash))

    @staticmethod
    def _engine_memory():
        from armtempo_board.motion.engine_memory import EngineMemory
        from armtempo_shared.engine_memory import LARGEST_BYTES

        made = EngineMemory(LARGEST_BYTES)
        made.make_memory(12 * 1026)
        return made

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

    def start(self, motion, homing=0, seeks=False):
        """Load and start a motion; ``homing``, ``seeks``: see ``Engine.load``."""
        self.samples = []
        for pulses, steps in zip(self.pulses, motion.joints):
            pulses.expect(steps)
        self.engine.load(motion, homing=homing, seeks=seeks)
        self.engine.start()

    def refusal(self, motion):
        """(code, joint, value) if it cannot be loaded, else None."""
        try:
            self.engine.load(motion)
        except Refused as refused:
            return refused.code, refused.joint, refused.value
        return None

    def trusting(self):
        """The steps of this motion are not planned here: do not watch them."""
        for pulses in self.pulses:
            pulses.ignore()

    def turn(self):
        """One pass of the main loop."""
        self.engine.service()
        buffer = array("i", [0] * (4 + 2 * len(self.joints)))
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
