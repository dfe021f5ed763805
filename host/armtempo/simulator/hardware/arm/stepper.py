"""Models of a motor with its encoder: ideal, or with lag, ringing and, if overloaded, lost steps.

The field pulls the rotor like a spring that slips (P. Acarnley, Stepping Motors, 4th ed., 2002, chapters
3 to 5)::

    J x'' = T(v) sin(2 pi (c - x) / 4 m) - D (v - c') - T_load(x)

with x the rotor's angle and c the command, both in microsteps, m microsteps a step. ``T(v)`` falls with speed
as the winding's inductance limits the current. The joint follows the rotor through gear and backlash; the encoder is on
one of the two.

The integration (drift-kick-drift) starts with each motion, in steps of 1 ms, or smaller ones if the rotor
oscillates fast. Each step uses the mean of the command within it, so that a pulse acts from its own time on.
"""

from math import asin, ceil, cos, pi, sin, sqrt

_DT_TICKS = 84_000
_DT_S = 0.001
_FINEST = 0.25  # rad: largest phase of the rotor's free oscillation in one part of a step
_REST_STEPS = 0.002
_SCATTER_LENGTH_DEG = 2.0  # of motion, over which the scatter of a new repetition fades in
_MULTIPLIER = 48271  # Park and Miller, Communications of the ACM 36 (1993) 7, page 105
_MODULUS = 0x7FFFFFFF


class IdealMotor:
    """An ideal motor: it loses no step, and the encoder follows without delay.

    ``step``, ``direction``: its pins; ``encoder``: the timer in encoder mode, or None; ``joint``: with
    ``dir_inverted``, ``encoder_inverted``, ``counts_num``, ``counts_den`` of the arm record.
    """

    def __init__(self, step, direction, enable, encoder, joint):
        self._pulses = step
        self._dir = direction
        self._enable = enable
        self._inverted = joint["dir_inverted"]
        self._encoder = encoder
        self._num = -joint["counts_num"] if joint["encoder_inverted"] else joint["counts_num"]
        self._den = joint["counts_den"]
        self.moved = False  # the encoder must be updated
        self._counts = self._at(0)
        self.position = 0  # steps taken since power-up
        self.blocked = False
        self._start_deg = joint.get("start_deg", 0.0)
        self._steps_per_deg = joint.get("steps_per_deg", 1.0)
        step.sinks.append(self)

    def disconnect(self):
        self._pulses.sinks.remove(self)

    def _at(self, position):
        return (2 * position * self._num + self._den) // (2 * self._den)

    def edges(self, line, before, count, times, origin):
        """STEP toggled; each rising edge is a step."""
        if self._enable.on() and not self.blocked:
            steps = (count + 1 - before) // 2
            forward = self._dir.level ^ self._inverted
            self.position += steps if forward else -steps
            self.moved = True

    def slip(self, counts):
        """The encoder's coupling slips by ``counts``."""
        self._counts -= counts
        self.moved = True

    def angle_deg(self):
        return self._start_deg + self.position / self._steps_per_deg

    def begin(self, now):
        """A motion begins."""

    def follow(self, now):
        """Turn the encoder to the motor's position."""
        self.moved = False
        counts = self._at(self.position)
        if self._encoder and counts != self._counts:
            self._encoder.turn(counts - self._counts)
        self._counts = counts


class Noise:
    """Random numbers from a seed, the same on every interpreter."""

    def __init__(self, seed):
        self._state = seed % (_MODULUS - 1) + 1
        for _ in range(8):
            self.uniform()

    def uniform(self):
        """In (0, 1)."""
        self._state = self._state * _MULTIPLIER % _MODULUS
        return self._state / _MODULUS

    def normal(self):
        """Standard normal, approximated by the sum of twelve uniform numbers."""
        return sum([self.uniform() for _ in range(12)]) - 6.0


class Stepper(IdealMotor):
    """``joint``: also with the joint's drive from the arm file, and its ``model``."""

    def __init__(self, step, direction, enable, encoder, joint, seed):
        super().__init__(step, direction, enable, encoder, joint)
        model = joint["model"]
        gear = joint["gear_ratio"]
        per_rad = self._steps_per_deg * 360 / gear / (2 * pi)  # of the motor shaft
        self._electrical = 2 * pi / (4 * joint["microsteps"])
        inertia = model["rotor_inertia_kg_m2"] + model["inertia_kg_m2"] / gear**2
        self._pull = model["holding_torque_nm"] * per_rad / inertia
        self._damping = model["damping_nm_s"] / inertia
        self._gravity = model["gravity_torque_nm"] / gear * per_rad / inertia
        self._slides = joint["slides"]
        self._corner = model["corner_speed_rad_s"] * per_rad
        self._play = model["backlash_deg"] * self._steps_per_deg / 2
        self._phase = model["encoder_phase_counts"]
        self._ratio = self._num / self._den
        self._on_motor = joint["encoder_on_motor"]
        self._parts = max(1, ceil(sqrt(self._pull * self._electrical) * _DT_S / _FINEST))
        self._noise = Noise(seed)
        self._scatter = model["scatter_deg"] * self._steps_per_deg
        self._wanted = self._offset = 0.0
        self._done = 0
        self._commanded = 0
        self._pending = []
        self._x = self._rest(0)
        self._v = 0.0
        self._joint = self._x
        self._counts = self._reading()

    def edges(self, line, before, count, times, origin):
        """STEP toggled: store the times of its rising edges."""
        rises = [origin + time for time in times[before::2]]
        if not rises or not self._enable.on():
            return
        if not self.moved:
            self.moved = True
            self._done += (rises[0] - self._done) // _DT_TICKS * _DT_TICKS
        direction = 1 if self._dir.level ^ self._inverted else -1
        for tick in rises:
            self._pending.append((tick, direction))
        self.position += direction * len(rises)

    def angle_deg(self):
        return self._start_deg + self._joint / self._steps_per_deg

    def begin(self, now):
        """A motion begins: start the time steps here, and draw a new scatter."""
        self._done = now
        self._wanted = self._noise.normal() * self._scatter

    def follow(self, now):
        """Time has passed."""
        if now - self._done >= _DT_TICKS:
            while self.moved and now - self._done >= _DT_TICKS:
                self._step()
            self._show()

    def _step(self):
        """One millisecond."""
        before = self._commanded
        mean = self._command() - self._offset
        speed = (self._commanded - before) / _DT_S
        x, v = self._x, self._v
        part = _DT_S / self._parts
        if self.blocked:
            v = 0.0
        else:
            for _ in range(self._parts):
                x += v * part / 2
                v = self._kick(mean - x, x, v, speed, part)
                x += v * part / 2
        self._fade_in(x - self._x)
        self._x, self._v = x, v
        self._joint = min(max(self._joint, x - self._play), x + self._play)
        if not self._pending and not speed and abs(v) * _DT_S < _REST_STEPS:
            self._settle()

    def _command(self):
        """Mean of the command over the next step; consumes its pulses."""
        begun = self._commanded
        end = self._done + _DT_TICKS
        weight = taken = 0
        for tick, direction in self._pending:
            if tick > end:
                break
            weight += direction * (end - tick)
            self._commanded += direction
            taken += 1
        if taken:
            self._pending = self._pending[taken:]
        self._done = end
        return begun + weight / _DT_TICKS

    def _kick(self, lead, x, v, speed, part):
        """Speed after the torques at ``x`` have acted for ``part`` seconds."""
        pull = self._pull
        if self._corner:
            pull /= sqrt(1 + (v / self._corner) ** 2)
        v += (pull * sin(lead * self._electrical) - self._weight(x)) * part
        return (v + self._damping * speed * part) / (1 + self._damping * part)

    def _weight(self, x):
        """Acceleration of the rotor by gravity at ``x``, in steps/s²."""
        if not self._gravity or self._slides:
            return self._gravity
        return self._gravity * cos((self._start_deg + x / self._steps_per_deg) * pi / 180)

    def _fade_in(self, moved):
        """Fade in the scatter of this repetition as the joint moves."""
        if self._offset != self._wanted:
            share = min(1.0, abs(moved) / (_SCATTER_LENGTH_DEG * self._steps_per_deg))
            self._offset += (self._wanted - self._offset) * share

    def _rest(self, near):
        """The rotor's rest position under load: near the commanded microstep, or multiples of four steps away."""
        cycle = 2 * pi / self._electrical
        aim = self._commanded - self._offset
        aim += round((near - aim) / cycle) * cycle
        load = max(-1.0, min(1.0, self._weight(aim) / self._pull))
        return aim - asin(load) / self._electrical

    def _settle(self):
        """Stop computing if the rotor has come to rest."""
        rest = self._rest(self._x)
        if self.blocked or abs(rest - self._x) < 20 * _REST_STEPS:
            if not self.blocked:
                self._x = rest
            self._v = 0.0
            self.moved = False

    def _reading(self):
        turned = self._x if self._on_motor else self._joint
        return int((turned * self._ratio + self._phase) // 1)

    def _show(self):
        counts = self._reading()
        if self._encoder and counts != self._counts:
            self._encoder.turn(counts - self._counts)
        self._counts = counts
