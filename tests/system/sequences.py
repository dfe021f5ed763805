"""A sequence on a virtual board, short motions of an arm with a gripper, what its pins did; the soak and its flash."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence as Several
from dataclasses import replace
from pathlib import Path

import armtempo
import numpy as np
from armtempo.encoding import encode, encoded_plan
from armtempo.encoding.encoded_plan import EncodedLeg
from armtempo.model import shipped
from armtempo.model.arm import Arm, Joint
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.model.plan import Plan
from armtempo.model.sequence import Sequence
from armtempo.planning import planner
from armtempo.simulator import InjectedFault, edgelog
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.motion import Motion

from tests import interpreters, scripted
from tests.board import oracle
from tests.system.replays import PINS

FOLDER = shipped.arm_path().parent / "pick_and_place"
SHIPPED = Arm.load(FOLDER / "arm.toml")
ARM = replace(SHIPPED, safety=replace(SHIPPED.safety, estop_fitted=True))
GRIPPER, PART = "B8", "D0"
"""Pins of the arm's output and input."""
ESTOP = "E15"
SMALL = """
name = "{name}"
start = "home"
[posture.pick]
angles_deg = {pick}
[posture.place]
angles_deg = {place}
[[step]]
repeat = {times}
[[step]]
goto = "pick"
[[step]]
wait_input = "part"
timeout_s = 1
on_timeout = "{on_timeout}"
[[step]]
output = "gripper"
to = "closed"
wait_s = 0.02
[[step]]
goto = "place"
[[step]]
output = "gripper"
to = "open"
wait_s = 0.02
[[step]]
goto = "home"
[[step]]
count = "parts"
[[step]]
end = "repeat"
"""


def small(
    folder: Path,
    times: int | str,
    on_timeout: str = "stop",
    name: str = "small",
    arm: Arm = ARM,
    size: float = 1.0,
) -> Plan:
    """A pick and place over fractions of a degree, or ``size`` times as far."""
    path = folder / f"{name}.toml"
    value = f'"{times}"' if isinstance(times, str) else times
    pick, place = (
        [round(home + size * by, 3) for home, by in zip(arm.home_deg, away, strict=True)]
        for away in ((0.6, -0.3, 0.5), (-0.5, 0.2, -0.4))
    )
    path.write_text(SMALL.format(name=name, times=value, on_timeout=on_timeout, pick=pick, place=place))
    return armtempo.plan_sequence(arm, Sequence.load(path, arm))


def part_lies_there() -> InjectedFault:
    """The part is seen from the first motion on."""
    return InjectedFault("input", 0.01, 1, name=PART, level=0)


def pauses_s(power: edgelog.PowerCycle, plan: Plan) -> list[float]:
    """From the planned end of each cycle's last motion to time 0 of the next one's first, seconds."""
    legs = len(plan.legs)
    return [
        (power.starts[n] - power.starts[n - 1]) / TICK_HZ - plan.legs[-1].trajectory.duration_s
        for n in range(legs, len(power.starts), legs)
    ]


def net_steps(power: edgelog.PowerCycle, arm: Arm = ARM) -> list[int]:
    """Where the pins have moved the joints since power-up, in steps."""
    found = []
    for (step, direction), joint in zip(PINS, arm.driven, strict=True):
        ticks, levels = power.pins.get(step, ((), ()))
        turns, after = power.pins.get(direction, ((), ()))
        found.append(_net(list(ticks), list(levels), list(turns), list(after)) * joint.motor.direction)
    return found


def _net(ticks: Several[int], levels: Several[int], turns: Several[int], after: Several[int]) -> int:
    position = at = 0
    level = 0 if not len(after) else 1 - int(after[0])
    for tick, risen in zip(ticks, levels, strict=True):
        while at < len(turns) and turns[at] <= tick:
            level = int(after[at])
            at += 1
        if risen:
            position += 1 if level else -1
    return position


# the soak: sequences in virtual time (scripts/cases/soak.py), and the flash of its board


SCRIPT = Path(__file__).parent / "scripts" / "cases" / "soak.py"
Angles = tuple[float, float, float]
AWAY: tuple[tuple[Angles, Angles], ...] = (
    ((1.7, -1.43, 2.5), (0.45, -0.45, -0.45)),
    ((-1.5, 2.31, 1.8), (-0.45, 0.45, -0.45)),
)
"""Postures: how far from home, and then from a whole step. The first steps of a motion that begins close to the middle
between two steps come close together, which is a case of its own to the step generator."""
MIDDLE_DEG = (1.6, -2.5, 1.4)
"""So far off the straight way these motions lead: joints turn in them."""
_GAP_TICKS = 20_000
"""Steps in opposite directions that are closer are both left out; no motion here comes near it."""


def make_flash(flash: Path) -> None:
    """``flash``: is made, with the arm's record, the motions, and ``motions``, the list that the script reads.

    The motions are those of the shipped pick and place, and those from each of some postures close to home to each
    other. A row of the list: name, numbers of the places where it begins and ends (0: home), steps.
    """
    folder = flash / "armtempo"
    folder.mkdir(parents=True)
    (folder / "arm.ata").write_bytes(encode.arm_record(ARM))
    plan = armtempo.plan_sequence(ARM, Sequence.load(FOLDER / "sequence.toml", ARM))
    motions = [*encoded_plan.of_plan(plan).legs]
    quick = replace(ARM, joints=tuple(_quick(joint) for joint in ARM.joints))
    assert encode.arm_record(quick) == encode.arm_record(ARM)
    per_deg = np.array([joint.steps_per_deg for joint in ARM.driven])
    postures = [np.array(ARM.home_deg)]
    for away_deg, fractions in AWAY:
        postures.append((np.rint((postures[0] + away_deg) * per_deg) + fractions) / per_deg)
    for number, ends in enumerate(itertools.permutations(postures, 2)):
        via = (ends[0], np.mean(ends, axis=0) + MIDDLE_DEG, ends[1])
        points = tuple(tuple(map(float, point)) for point in via)
        job = Job(f"leg{number}", points, population=5, iterations=20, refine=1, path="through")
        motions += encoded_plan.of_trajectory(planner.plan(quick, job).trajectory, quick).legs
    places: dict[tuple[float, ...], int] = {tuple(ARM.home_deg): 0}
    rows = []
    for motion in motions:
        (folder / f"{motion.name}.atm").write_bytes(motion.data)
        ends = [
            tuple(round(float(joint(at)), 3) for joint in motion.trajectory.joints)
            for at in (0.0, motion.trajectory.duration_s)
        ]
        rows.append(
            [motion.name, *(places.setdefault(end, len(places)) for end in ends), steps_in_order(motion)]
        )
    (folder / "motions").write_text(json.dumps(rows))


def soak(interpreter: str, folder: Path, legs: int, seed: int) -> str:
    """Make at least this many motions on the board whose flash is in ``folder``; what was done, and how often."""
    home = ",".join(
        str(round(angle * joint.steps_per_deg)) for angle, joint in zip(ARM.home_deg, ARM.driven, strict=True)
    )
    program = f"{interpreters.ROOT / 'board'}:{interpreters.ROOT / 'shared'}"
    words = (str(folder), program, home, f"legs={legs}", f"seed={seed}")
    return interpreters.run(
        interpreter, SCRIPT, *words, timeout=3600 + 10 * legs, heap=scripted.HEAP[interpreter]
    )


def _quick(joint: Joint) -> Joint:
    """With more acceleration and jerk, of which the board knows nothing, so that its motions take less time."""
    limits = joint.limits
    if limits is None:
        return joint
    jerk = 600 * limits.jerk_deg_s3
    return replace(joint, limits=Limits(limits.speed_deg_s, 30 * limits.acceleration_deg_s2, jerk))


def steps_in_order(encoded: EncodedLeg) -> list[list[int]]:
    """Of each joint its steps in order: how many in one direction, how many in the other, ...; below 0: down."""
    motion = Motion(encoded.data)
    return [
        [
            int(direction) * len(list(steps))
            for direction, steps in itertools.groupby(
                oracle.without_grazes(oracle.crossings(motion, joint), _GAP_TICKS).direction
            )
        ]
        for joint in range(motion.joints)
    ]
