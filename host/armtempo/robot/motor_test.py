"""The self-test with motors: each joint moves a degree or mm there and back, slowly; switches and E-stop are pressed.

It uses the usual moves of the board program, so everything that stops a motion stops these.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import NamedTuple

from armtempo_shared import codes

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, BoardError, InputError
from armtempo.diagnosis.finding import Level
from armtempo.diagnosis.selftest.result import Measurement, SelfTest, judged
from armtempo.diagnosis.selftest.selftest import UNIQUE_ID_DIGITS
from armtempo.link import Client
from armtempo.model.arm import Arm
from armtempo.model.parts import DrivenJoint
from armtempo.planning.jog.jog_motion import SLOWEST, by_of_joint, move_of
from armtempo.robot import arm_state, jog
from armtempo.robot.stop_request import StopRequest

PART = "motors"
ARM_FILE = "arm_file"
"""Key of the data: lines to correct in the arm file."""
MOST_DEG = 1.0
_OF_FOLLOWING = 0.4
"""Largest move as a fraction of the following error: an encoder that counts backwards then causes no fault."""
_SPEED = 0.05
_NOISE_COUNTS = 2
_RATIO_OFF = 0.03
_TRIES = 3
_RELEASE_S = 30.0
_LOOK_S = 0.2
_WIRING = "check its wire, its pin in the arm file, and the level at which it trips"


def question(arm: Arm, posture_deg: Array) -> str:
    """The question to confirm: lists all moves from this posture, degrees (J,)."""
    moves = zip(arm.driven, posture_deg, strict=True)
    joints = ", ".join(
        f"{joint.name} by {move_deg(joint, at_deg):+.2g}{joint.unit.sign}" for joint, at_deg in moves
    )
    return (
        f"arm {arm.name!r}: the drivers are switched on, and these move there and back, slowly, one after the other: "
        f"{joints}. Is the arm supported and everybody clear of it?"
    )


def move_deg(joint: DrivenJoint, at_deg: float) -> float:
    """The move of a joint, degrees, towards the farther end of its range."""
    low_deg, high_deg = joint.range_deg
    following_deg = joint.encoder.following_error_deg if joint.encoder else 0.0
    size_deg = min(MOST_DEG, _OF_FOLLOWING * following_deg) if following_deg else MOST_DEG
    return size_deg if high_deg - at_deg >= at_deg - low_deg else -size_deg


class Moved(NamedTuple):
    """What a joint's motor and encoder did in a move."""

    steps: int
    counts: int


class MotorTest:
    """``ask``: asks the person at the arm, True for yes; ``tell``: prints what to do."""

    def __init__(
        self,
        client: Client,
        arm: Arm,
        stop: StopRequest,
        ask: Callable[[str], bool],
        tell: Callable[[str], object],
    ) -> None:
        info = client.info
        self.found = SelfTest(info.board_id[:UNIQUE_ID_DIGITS], info.virtual, info.program_crc)
        self.found.data[ARM_FILE] = []
        self._client, self._arm, self._stop, self._ask, self._tell = client, arm, stop, ask, tell

    def run(self) -> SelfTest:
        """Run the test. Raises LinkError if a position is unknown, ArmtempoError without a yes, before
        anything moves."""
        posture_deg = arm_state.posture_deg(self._client, self._arm)
        if not self._ask(question(self._arm, posture_deg)):
            raise ArmtempoError(
                "the test with motors was not confirmed: nothing moved",
                "run it again and answer y when it is safe",
            )
        try:
            for joint, at_deg in zip(self._arm.driven, posture_deg, strict=True):
                self._joint(joint, move_deg(joint, at_deg))
            for joint, at_deg in zip(self._arm.driven, posture_deg, strict=True):
                self._switches(joint, at_deg)
            self._estop(posture_deg[0])
        except BoardError as error:
            self.found.add([judged(PART, "the rest", error.problem, "no fault", False, error.hint)])
        return self.found

    def _joint(self, joint: DrivenJoint, by_deg: float) -> None:
        """Move a joint there and back, each in two halves: the first takes up the play of its gear, the second is
        without it."""
        self._moved(joint, 0.5 * by_deg)
        there = self._moved(joint, 0.5 * by_deg)
        way = "larger" if by_deg > 0 else "smaller"
        moved = f"slide towards {way} positions" if joint.slides else f"turn towards {way} angles"
        is_right = self._ask(f"did {joint.name} just {moved}?")
        reversed_ = self._moved(joint, -0.5 * by_deg)
        back = self._moved(joint, -0.5 * by_deg)
        cure, lines = (
            "change the motor's direction in the arm file",
            [f"motor: direction = {-joint.motor.direction}"],
        )
        is_coupled = self._is_coupled(joint)
        if is_coupled:
            cure = (
                "change the direction of a motor that turns it, or the signs in [coupling], in the arm file"
            )
            lines = []
        motor = judged(
            PART, f"{joint.name}: direction", "as in the arm file" if is_right else "the other way",
            "as in the arm file", is_right, cure,
        )  # fmt: skip
        sign = 1 if is_right or is_coupled else -1
        steps, counts = there.steps - back.steps, sign * (there.counts - back.counts)
        found = [judge_encoder(joint, steps, counts)]
        if joint.encoder and joint.encoder.on == "joint":
            play, of_play = judge_backlash(joint, reversed_, back)
            if play and play.verdict is Level.ERROR:
                found = []  # nothing moved the encoder as far as it should count
            found += [(play, of_play)] if play else []
        self.found.add([motor, *(line for line, _ in found)])
        lines = [*([] if is_right else lines), *(line for _, of_line in found for line in of_line)]
        self.found.data[ARM_FILE] += [f"{joint.name}: {line}" for line in lines]

    def _is_coupled(self, joint: DrivenJoint) -> bool:
        return len(self._arm.transmission.group(self._arm.driven.index(joint))) > 1

    def _moved(self, joint: DrivenJoint, by_deg: float) -> Moved:
        """Jog a joint; returns what its motor and encoder did."""
        index = self._arm.driven.index(joint)
        before = self._client.status().positions
        self._jog(joint, by_deg, _SPEED)
        after = self._client.status().positions
        return Moved(
            after.commanded_steps[index] - before.commanded_steps[index],
            after.counts[index] - before.counts[index],
        )

    def _jog(self, joint: DrivenJoint, by_deg: float, speed: float) -> None:
        move = move_of(self._arm, joint.name, None, *by_of_joint(self._arm, joint.name, by_deg))
        jog.step(self._client, self._arm, move, speed, self._stop)

    def _switches(self, joint: DrivenJoint, at_deg: float) -> None:
        for end, side, switch in (("low", -1, joint.switches.low), ("high", 1, joint.switches.high)):
            if isinstance(switch, int):  # a switch on a pin is used for homing only
                what = f"the switch at the {end} end of {joint.name}"
                self._press(what, codes.LIMIT_SWITCH, joint, at_deg, side)

    def _estop(self, at_deg: float) -> None:
        if self._arm.safety.estop_fitted:
            self._press("the E-stop", codes.ESTOP, self._arm.driven[0], at_deg)
        else:
            self.found.add([Measurement(PART, "E-stop", "the arm file has none")])

    def _press(self, what: str, code: int, joint: DrivenJoint, at_deg: float, side: int = 0) -> None:
        """Move ``joint`` slowly from ``at_deg`` and back until the pressed switch stops it, on its way to ``side``."""
        self._tell(f"press {what} now, while {joint.name} moves slowly to and fro; keep clear of the arm")
        by_deg = move_deg(joint, at_deg)
        measured, is_seen = "not seen", False
        for to_deg, way in ((at_deg + by_deg, by_deg), (at_deg, -by_deg)) * _TRIES:
            try:
                self._go(joint, to_deg)
            except BoardError as error:
                measured = f"fault {error.code}"
                if error.code == code:
                    is_seen = side * way >= 0.0
                    measured = f"stopped the joint{'' if is_seen else ' on its way to the other end'}"
                self._released(what, error.code, joint, to_deg)
                break
        self.found.add([judged(PART, what, measured, "stops the joint", is_seen, _WIRING)])

    def _go(self, joint: DrivenJoint, to_deg: float) -> None:
        here_deg = arm_state.posture_deg(self._client, self._arm)
        by_deg = jog.distance_deg(here_deg, self._arm, joint.name, to_deg)
        with suppress(InputError):  # it is as far as it can go
            if by_deg:
                self._jog(joint, by_deg, SLOWEST)

    def _released(self, what: str, code: int, joint: DrivenJoint, to_deg: float) -> None:
        """Clear the fault once its cause is gone: a limit switch, once the joint can go on, as a switch that is still
        pressed would be taken for the next one. Raises BoardError if that takes too long."""
        limit_s = time.monotonic() + _RELEASE_S
        self._tell(f"release {what}")
        while True:
            try:
                self._client.clear()
                if code == codes.LIMIT_SWITCH:
                    self._go(joint, to_deg)
                return
            except BoardError:
                if time.monotonic() > limit_s:
                    raise
                time.sleep(_LOOK_S)


def judge_encoder(joint: DrivenJoint, steps: int, counts: int) -> tuple[Measurement, list[str]]:
    """Compare the encoder's counts with the joint's steps; also returns lines to correct in the arm file.

    ``counts``: with the sign for a motor that turns the right way.
    """
    what = f"{joint.name}: encoder"
    if joint.encoder is None:
        return Measurement(PART, what, "the arm file has none"), []
    due = float(joint.counts_per_step * steps)
    allowed = _NOISE_COUNTS + _RATIO_OFF * abs(due)
    off_deg = abs(counts - due) / joint.counts_per_deg
    measured = f"{counts} counts for {steps} steps, {off_deg:.2f}{joint.unit.sign} off"
    expected = f"{due:.0f} counts, within {allowed:.0f}"
    if abs(counts - due) <= allowed:
        return Measurement(PART, what, measured, expected, Level.GOOD), []
    lines = list(_corrections(joint, due, counts))
    cure = (
        "see the lines for the arm file"
        if lines
        else "check its plug, its coupling, its channel; does the motor turn?"
    )
    return Measurement(PART, what, measured, expected, Level.ERROR, cure), lines


def judge_backlash(
    joint: DrivenJoint, reversed_: Moved, further: Moved
) -> tuple[Measurement | None, list[str]]:
    """The backlash of a joint, by the encoder on it and what its motor crosses; also returns lines for the arm file.

    ``reversed_``: a move in the other direction than the one before; ``further``: one as far in the same direction,
    with the play taken up. Both ends of a move are counts that may be off by one. None if the encoder does not count.
    """
    what, within_deg = f"{joint.name}: backlash", _NOISE_COUNTS / joint.counts_per_deg
    seen, whole, sign = abs(reversed_.counts), abs(further.counts), joint.unit.sign
    lost_deg, crossed_deg = (whole - seen) / joint.counts_per_deg, joint.motor.backlash_deg
    if whole <= _NOISE_COUNTS:
        return None, []
    if abs(lost_deg) <= within_deg or (lost_deg < 0.0 and not crossed_deg):
        beside = f" beside the {crossed_deg:g}{sign} that its motor crosses" if crossed_deg else ""
        measured = f"none that its encoder shows{beside}, less than {within_deg:.2g}{sign}"
        return Measurement(PART, what, measured), []
    if seen <= _NOISE_COUNTS:
        size_deg = abs(reversed_.steps) / joint.steps_per_deg
        measured = f"it did not move in the first {size_deg:.2g}{sign} after it was reversed"
        cure = "look for a loose coupling, belt or set screw; its encoder was not checked"
        return judged(PART, what, measured, f"less than {size_deg:.2g}{sign}", False, cure), []
    whole_deg = max(crossed_deg + lost_deg, 0.0)
    measured = f"{whole_deg:.2g}{sign}, read to {within_deg:.2g}{sign}, of the joint against its motor"
    if crossed_deg:
        measured += f", which crosses {crossed_deg:g}{sign}"
    return Measurement(PART, what, measured), [
        f"motor: {joint.unit.key('backlash_deg')} = {whole_deg:.2g} or so, which its motor then crosses at each "
        "reversal; for the virtual arm the same in model"
    ]


def _corrections(joint: DrivenJoint, due: float, counts: int) -> Iterator[str]:
    """Lines for the arm file; none if the encoder hardly turned."""
    assert joint.encoder is not None
    if abs(counts) <= _NOISE_COUNTS:
        return
    if counts * due < 0:
        yield f"encoder: direction = {-joint.encoder.direction}"
    ratio = abs(counts / due)
    if abs(abs(counts) - abs(due)) > _NOISE_COUNTS + _RATIO_OFF * abs(due):
        per_rev = round(joint.encoder.counts_per_rev * ratio)
        lead = "mm_per_rev" if joint.slides else "gear_ratio"
        yield (
            f"encoder: counts_per_rev = {per_rev} or so; or the motor's microsteps or {lead}, as it moved "
            f"{ratio:.2g} times as far"
        )
