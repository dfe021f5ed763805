"""The soak: sequences in virtual time (scripts/cases/soak.py), and the flash of its board.

The flash has motions between postures, and a list of the steps that each record has.
"""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from pathlib import Path

import armtempo
import numpy as np
from armtempo.model.arm import Joint
from armtempo.model.job import Job
from armtempo.model.parts import Limits
from armtempo.model.sequence import Sequence
from armtempo.planning import planner
from armtempo.records import encode, encoded_motion, encoded_sequence
from armtempo.records.encoded_motion import EncodedMotion
from armtempo_shared.motion import Motion

from tests import interpreters, scripted
from tests.board import oracle
from tests.system.sequences import ARM, FOLDER

SCRIPT = Path(__file__).parent / "scripts" / "cases" / "soak.py"
Angles = tuple[float, float, float]
AWAY: tuple[tuple[Angles, Angles], ...] = (
    ((1.7, -1.43, 2.5), (0.45, -0.45, -0.45)),
    ((-1.5, 2.31, 1.8), (-0.45, 0.45, -0.45)),
    ((0.2, 4.1, -5.3), (0.45, 0.45, 0.45)),
)
"""Postures: how far from home, and then from a whole step. The first steps of a motion that begins close to the middle
between two steps come close together, which is a case of its own to the step generator."""
MIDDLE_DEG = (1.6, -2.5, 1.4)
"""So far off the straight way these motions lead: joints turn in them."""
_GAP_TICKS = 20_000
"""Steps in opposite directions that are closer are both left out; no motion here comes near it."""


def make_flash(flash: Path, away: tuple[tuple[Angles, Angles], ...] = AWAY) -> None:
    """``flash``: is made, with the arm's record, the motions, and ``motions``, the list that the script reads.

    The motions are those of the shipped pick and place, and those from each of some postures close to home to each
    other. A row of the list: name, numbers of the places where it begins and ends (0: home), steps.
    """
    folder = flash / "armtempo"
    folder.mkdir(parents=True)
    (folder / "arm.ata").write_bytes(encode.arm_record(ARM))
    plan = armtempo.plan_sequence(ARM, Sequence.load(FOLDER / "sequence.toml", ARM))
    motions = [*encoded_sequence.of_plan(plan).motions]
    quick = replace(ARM, joints=tuple(_quick(joint) for joint in ARM.joints))
    assert encode.arm_record(quick) == encode.arm_record(ARM)
    per_deg = np.array([joint.steps_per_deg for joint in ARM.driven])
    postures = [np.array(ARM.home_deg)]
    for away_deg, fractions in away:
        postures.append((np.rint((postures[0] + away_deg) * per_deg) + fractions) / per_deg)
    for number, ends in enumerate(itertools.permutations(postures, 2)):
        via = (ends[0], np.mean(ends, axis=0) + MIDDLE_DEG, ends[1])
        points = tuple(tuple(map(float, point)) for point in via)
        job = Job(f"leg{number}", points, population=5, iterations=20, refine=1)
        motions.append(encoded_motion.of_trajectory(planner.plan(quick, job).trajectory, quick))
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


def run(interpreter: str, folder: Path, legs: int, seed: int) -> str:
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


def steps_in_order(encoded: EncodedMotion) -> list[list[int]]:
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
