"""An ideal motor: each step counts, and the encoder follows at once."""


class IdealMotor:
    """One joint's motor and encoder.

    ``step``, ``direction``: its lines; ``encoder``: the timer that counts it, or None; ``joint``:
    ``dir_inverted``, ``encoder_inverted``, ``counts_num``, ``counts_den`` as in the arm record.
    """

    def __init__(self, step, direction, enable, encoder, joint):
        self._pulses = step
        self._dir = direction
        self._enable = enable
        self._inverted = joint["dir_inverted"]
        self._encoder = encoder
        self._num = -joint["counts_num"] if joint["encoder_inverted"] else joint["counts_num"]
        self._den = joint["counts_den"]
        self.moved = False  # the encoder has to be updated
        self._counts = self._at(0)
        self.position = 0  # steps taken since power-up
        self.blocked = False
        self._start_deg = joint.get("start_deg", 0.0)
        self._steps_per_deg = joint.get("steps_per_deg", 1.0)
        step.sinks.append(self)

    def disconnect(self):
        """Take it off the pins."""
        self._pulses.sinks.remove(self)

    def _at(self, position):
        return (2 * position * self._num + self._den) // (2 * self._den)

    def edges(self, line, before, count, times, origin):
        """STEP toggled; rising edges step."""
        if self._enable.on() and not self.blocked:
            steps = (count + 1 - before) // 2
            forward = self._dir.level ^ self._inverted
            self.position += steps if forward else -steps
            self.moved = True

    def slip(self, counts):
        """The encoder's coupling slips by that many counts."""
        self._counts -= counts
        self.moved = True

    def angle_deg(self):
        """The joint's angle."""
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
