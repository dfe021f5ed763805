"""The motors and limit switches of the arm record, on the board's pins."""

from armtempo_shared import armrecord
from chip import gpio
from firmware.external_interrupts import set_level

from arm.stepper import IdealMotor, Stepper


class Enable:
    """The drivers' common ENABLE signal."""

    def __init__(self, board, pin, active_high):
        self._line = board.pins.line(pin)
        self._active = 1 if active_high else 0

    def on(self):
        """Whether the drivers are enabled."""
        return self._line.level == self._active and self._line.mode() == gpio.OUTPUT


class ArmOnPins:
    """All motors of the arm record in the flash.

    ``record()`` returns (head, joints) or None; ``angles``: the joints' angles, default those in ``joints``.
    """

    def __init__(self, board, pins, record, seed, angles):
        self._seed = seed
        self._angles = angles
        self._switches = ()
        self.board = board
        self._pins = pins
        self._record = record
        self._known = None
        self.motors = []
        self.watches_host = False
        board.follow = self.follow
        board.observers.append(self)
        self.connect()

    def connect(self):
        """Connect motors to the pins if the record has changed."""
        found = self._record()
        if found == self._known:
            return
        self._known = found
        for motor in self.motors:
            motor.disconnect()
        head, joints = found or ({"flags": 0}, ())
        self.watches_host = bool(head["flags"] & armrecord.FLAG_STOP_ON_LINK_LOSS)
        enable = Enable(self.board, self._pins.ENABLE, head["flags"] & armrecord.FLAG_ENABLE_HIGH)
        self.motors = [self._motor(number, joint, enable) for number, joint in enumerate(joints)]
        if head["flags"] & armrecord.FLAG_ESTOP_FITTED:
            set_level(self._pins.ESTOP, 0 if head["flags"] & armrecord.FLAG_ESTOP_ACTIVE_HIGH else 1)
        self._switches = []
        for number, joint in enumerate(joints):
            turned = self.motors[number]
            if joint.get("by_motors"):
                turned = CoupledJoint(self.motors, joint["by_motors"])
            self._switches.extend(limit_switches(turned, joint, self._pins))
        self.follow()

    def _motor(self, number, joint, enable):
        lines, pins = self.board.pins, self._pins
        step, direction = pins.STEP[joint["channel"]][0], pins.DIR[joint["channel"]]
        encoder = None
        if joint["encoder"] < len(pins.ENCODER):
            encoder = self.board.timers[pins.ENCODER[joint["encoder"]][0]]
        step, direction = lines.line(step), lines.line(direction)
        if number < len(self._angles):
            joint = dict(joint, start_deg=self._angles[number])
        if joint.get("model") and joint["model"]["holding_torque_nm"]:
            return Stepper(step, direction, enable, encoder, joint, 100 * self._seed + number)
        return IdealMotor(step, direction, enable, encoder, joint)

    def follow(self):
        """Time has passed."""
        for motor in self.motors:
            if motor.moved:
                motor.follow(self.board.now)
        for switch in self._switches:
            switch.look()

    def counting(self, timer, now):
        """A timer started or stopped: motions begin with TIM2."""
        if timer.number == 2 and timer.running:
            for motor in self.motors:
                motor.begin(now)

    def input_changed(self, line, level, now):
        """An input changed: nothing to do."""


class CoupledJoint:
    """A joint whose angle is the sum of the ``motors``' angles times ``shares``."""

    def __init__(self, motors, shares):
        self._parts = [part for part in zip(motors, shares) if part[1]]

    def angle_deg(self):
        return sum([share * motor.angle_deg() for motor, share in self._parts])


class LimitSwitch:
    """The switch at one end: it trips at ``trip_deg`` and above (``side`` 1) or below (-1)."""

    def __init__(self, joint, side, trip_deg, pin, active_high):
        self._joint = joint
        self._side = side
        self._trip = side * trip_deg
        self._pin = pin
        self._active = active_high
        self._tripped = None

    def look(self):
        """Set the input from the joint's angle."""
        tripped = self._side * self._joint.angle_deg() >= self._trip
        if tripped != self._tripped:
            self._tripped = tripped
            set_level(self._pin, self._active if tripped else 1 - self._active)


def limit_switches(turned, joint, pins):
    """The joint's switches of known angle, by the angle of what is ``turned``; the inputs of others stay untripped."""
    found = []
    for side, channel, trip_deg in (
        (-1, joint["limit_low"], joint.get("low_deg")),
        (1, joint["limit_high"], joint.get("high_deg")),
    ):
        if channel == armrecord.NONE:
            continue
        pin = pins.LIMIT[channel] if channel < armrecord.POLLED else pins.name(channel - armrecord.POLLED)
        if trip_deg is None:
            set_level(pin, 1 - joint["limit_active_high"])
        else:
            found.append(LimitSwitch(turned, side, trip_deg, pin, joint["limit_active_high"]))
    return found
