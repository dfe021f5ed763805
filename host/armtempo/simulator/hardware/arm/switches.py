"""Limit switches, tripped by the angle of a joint."""

from armtempo_shared import armrecord
from firmware.external_interrupts import set_level


class LimitSwitch:
    """One end of a joint: ``side`` 1 trips at and above ``trip_deg``, -1 at and below."""

    def __init__(self, motor, side, trip_deg, pin, active_high):
        self._motor = motor
        self._side = side
        self._trip = side * trip_deg
        self._pin = pin
        self._active = active_high
        self._tripped = None

    def look(self):
        """Set the input by the joint's angle."""
        tripped = self._side * self._motor.angle_deg() >= self._trip
        if tripped != self._tripped:
            self._tripped = tripped
            set_level(self._pin, self._active if tripped else 1 - self._active)


def fitted(motor, joint, pins):
    """The switches of a joint whose angle is known; the inputs of the others are left untripped."""
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
            found.append(LimitSwitch(motor, side, trip_deg, pin, joint["limit_active_high"]))
    return found
