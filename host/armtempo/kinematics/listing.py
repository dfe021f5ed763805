"""What is to say about a pose: its solutions as a table to read and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from armtempo.kinematics import numerical
from armtempo.kinematics.choice import Candidate, Choice, choose
from armtempo.kinematics.geometry import Array, Geometry
from armtempo.kinematics.numerical import NumericalSolution
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.solutions import ELBOW_STRETCHED, ON_AXIS_1, WRIST_STRAIGHT

SINGULAR = {
    ON_AXIS_1: "wrist centre on axis 1: joint 1 kept as before",
    ELBOW_STRETCHED: "elbow stretched or folded: up and down are one",
    WRIST_STRAIGHT: "theta5 = 0: joint 4 kept as before, joint 6 makes up the sum",
}


@dataclass(frozen=True, eq=False)
class Answer:
    """The answer for one pose."""

    text: tuple[str, ...]
    values: dict[str, Any]
    """JSON values."""
    angles_rad: Array | None
    """The posture chosen; None: there is none."""


def answers(
    geometry: Geometry, ranges: Ranges, poses: Iterable[Array], previous_rad: Array, numerically: bool
) -> Iterator[Answer]:
    """Solve poses, (4, 4) each, one after the other, each nearest to the posture chosen before."""
    for pose in poses:
        solve = _searched if numerically else _chosen
        answer = solve(geometry, ranges, pose, previous_rad)
        if answer.angles_rad is not None:
            previous_rad = answer.angles_rad
        yield answer


def _chosen(geometry: Geometry, ranges: Ranges, pose: Array, previous: Array) -> Answer:
    choice = choose(geometry, pose, ranges, previous)
    angles = choice.chosen.angles_rad if choice.chosen else None
    return Answer(tuple(lines(choice)), {"pose": pose.tolist(), **values(choice)}, angles)


def _searched(geometry: Geometry, ranges: Ranges, pose: Array, previous: Array) -> Answer:
    found = numerical.solve(geometry, pose, ranges, previous)
    angles = found.angles_rad if found.found else None
    return Answer(
        tuple(numerical_lines(found)), {"pose": pose.tolist(), "numerical": numerical_values(found)}, angles
    )


def lines(choice: Choice) -> Iterator[str]:
    """Write the table, the chosen solution marked by ``*``, angles in degrees."""
    yield (
        f"region {choice.region} of Fig. 3: "
        + ("any angle of joint 1, and " if choice.on_axis else "")
        + f"{choice.postures} arm posture{'' if choice.postures == 1 else 's'}"
    )
    heads = "".join(f"{f'theta{i} deg':>12}" for i in range(1, 7))
    yield f"  no  {'branch':<19}{heads}  "
    for candidate in choice.candidates:
        mark = "*" if candidate is choice.chosen else " "
        angles = np.round(_degrees(candidate), 4) + 0.0
        row = "".join(f"{angle:12.4f}" if np.isfinite(angle) else f"{'-':>12}" for angle in angles)
        yield f"{mark} {candidate.number:2d}  {candidate.branch!s:<19}{row}  {_verdict(choice, candidate)}"


def _verdict(choice: Choice, candidate: Candidate) -> str:
    words = [SINGULAR[bit] for bit in SINGULAR if candidate.singular & bit]
    if candidate.rejections:
        words.insert(0, "rejected: " + "; ".join(reason.text for reason in candidate.rejections))
    else:
        distance = f"{np.degrees(candidate.distance_rad):.1f} deg from the previous posture"
        words.insert(0, f"chosen, {distance}" if candidate is choice.chosen else f"usable, {distance}")
    return ". ".join(words)


def values(choice: Choice) -> dict[str, Any]:
    """Give the same as JSON values; angles that do not exist are null."""
    return {
        "region": choice.region,
        "postures": choice.postures,
        "on_axis_1": choice.on_axis,
        "chosen": choice.chosen.number if choice.chosen else None,
        "solutions": [
            {
                "number": candidate.number,
                "branch": candidate.branch._asdict(),
                "angles_deg": _degrees(candidate).tolist() if np.isfinite(candidate.distance_rad) else None,
                "usable": not candidate.rejections,
                "rejections": [asdict(reason) for reason in candidate.rejections],
                "singular": [SINGULAR[bit] for bit in SINGULAR if candidate.singular & bit],
            }
            for candidate in choice.candidates
        ],
    }


def numerical_lines(solution: NumericalSolution) -> Iterator[str]:
    """Write the one solution of the numerical solver, or why there is none."""
    if not solution.found:
        yield f"rejected: {solution.reason}"
        return
    angles = "  ".join(f"theta{i} {angle:.4f}" for i, angle in enumerate(_clean(solution.angles_rad), 1))
    yield f"one solution, in degrees, found numerically: {angles}"


def numerical_values(solution: NumericalSolution) -> dict[str, Any]:
    """Give the same as JSON values."""
    return {
        "found": solution.found,
        "angles_deg": _clean(solution.angles_rad).tolist(),
        "position_error_mm": solution.position_error,
        "rotation_error_deg": float(np.degrees(solution.rotation_error_rad)),
        "starts": solution.starts,
        "reason": solution.reason,
    }


def _degrees(candidate: Candidate) -> Array:
    return _clean(candidate.angles_rad)


def _clean(angles_rad: Array) -> Array:
    """Degrees without negative zeros."""
    degrees: Array = np.degrees(angles_rad) + 0.0
    return degrees
