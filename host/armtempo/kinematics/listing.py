"""The solutions of a pose as a table and as JSON values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from armtempo.basics.arrays import Array
from armtempo.kinematics.choice import Candidate, Choice
from armtempo.kinematics.constraint import Miss
from armtempo.kinematics.numerical import NumericalSolution, NumericalSolutions
from armtempo.kinematics.rejection import Rejection
from armtempo.kinematics.solutions import ELBOW_STRETCHED, ON_AXIS_1, WRIST_STRAIGHT
from armtempo.kinematics.solver import CLOSED_FORM, NUMERICAL, Answer, PoseSolver
from armtempo.model.joint_unit import DEG, JointUnit, names
from armtempo.model.pose import to_rpy_deg
from armtempo.model.tool_pose import Pose

SINGULAR = {
    ON_AXIS_1: "wrist centre on axis 1: joint 1 kept as before",
    ELBOW_STRETCHED: "elbow stretched or folded: up and down are one",
    WRIST_STRAIGHT: "theta5 = 0: joint 4 kept as before, joint 6 makes up the sum",
}


@dataclass(frozen=True)
class Listing:
    """The answer for one pose, in words and as JSON values."""

    text: tuple[str, ...]
    values: dict[str, Any]
    success: bool


def listings(
    solver: PoseSolver, targets: Iterable[Pose], previous_rad: Sequence[float], numerically: bool
) -> Iterator[Listing]:
    """Solve targets one after the other, each nearest to the posture chosen before."""
    for target in targets:
        answer = solver.solve(target, previous_rad, numerically)
        if answer.success:
            previous_rad = answer.angles_rad
        yield Listing(tuple(lines(answer)), values(answer), answer.success)


def lines(answer: Answer) -> Iterator[str]:
    """The table, with the chosen solution marked by ``*``, angles in degrees, and the tool's pose."""
    if answer.choice:
        yield from _closed_form_lines(answer.choice, _units(answer))
    if answer.search and (answer.success or not answer.choice):
        yield from _numerical_lines(answer.search, _units(answer))
    if answer.reason:
        yield f"rejected: {answer.reason.splitlines()[0]}"  # the table above has the reasons one by one
    yield from _tool_lines(answer)


def _closed_form_lines(choice: Choice, units: Sequence[JointUnit]) -> Iterator[str]:
    yield (
        f"{choice.postures} of 4 arm postures reach the wrist centre"
        + (", with any angle of joint 1" if choice.on_axis else "")
        + f" (the paper's region {choice.region})"
    )
    yield f"  no  {'branch':<19}{_heads(units)}"
    for candidate in choice.candidates:
        chosen = candidate is choice.chosen
        singular = [SINGULAR[bit] for bit in SINGULAR if candidate.singular & bit]
        words = ". ".join((_verdict(candidate, chosen, units), *singular))
        yield f"{_mark(chosen, candidate.number)}{candidate.branch!s:<19}{_row(candidate.angles_rad)}  {words}"


def _units(answer: Answer) -> list[JointUnit]:
    """Of all joints."""
    return [joint.unit for joint in answer.arm.joints]


def _numerical_lines(search: NumericalSolutions, units: Sequence[JointUnit]) -> Iterator[str]:
    count = len(search.solutions)
    yield (
        f"{search.target.description}: {count} posture{'' if count == 1 else 's'} found numerically from "
        f"{search.starts} start{'' if search.starts == 1 else 's'}"
        + (", of many: it leaves joints free" if search.leaves_free else "")
    )
    if search.solutions:
        yield f"  no  {_heads(units)}"
    for number, solution in enumerate(search.solutions, 1):
        chosen = solution is search.chosen
        yield f"{_mark(chosen, number)}{_row(solution.angles_rad)}  {_verdict(solution, chosen, units)}"


def _tool_lines(answer: Answer) -> Iterator[str]:
    """The tool's pose, and its distance from the wanted pose."""
    if not answer.success:
        yield f"nearest posture found, {names(_units(answer))}: {' '.join(_row(answer.angles_rad).split())}"
    position = " ".join(_short(value, 4) for value in answer.tool[:3, 3])
    roll, pitch, yaw = (_short(value, 4) for value in to_rpy_deg(answer.tool))
    yield (
        f"tool at {position} mm, roll {roll}, pitch {pitch}, yaw {yaw} deg: {_describe_miss(answer.miss)} from the pose"
    )
    if (driven := _describe_miss(answer.miss_driven)) != _describe_miss(answer.miss):
        yield f"with the joints that have no motor at home the tool is {driven} from the pose"


def _heads(units: Sequence[JointUnit]) -> str:
    named = (f"{'theta' if unit is DEG else 'd'}{number} {unit.name}" for number, unit in enumerate(units, 1))
    return "".join(f"{head:>12}" for head in named)


def _mark(chosen: bool, number: int) -> str:
    return f"{'*' if chosen else ' '} {number:2d}  "


def _row(angles_rad: Iterable[float]) -> str:
    degrees = (round(math.degrees(angle), 4) + 0.0 for angle in angles_rad)
    return "".join(f"{angle:12.4f}" if math.isfinite(angle) else f"{'-':>12}" for angle in degrees)


def _verdict(solution: Candidate | NumericalSolution, chosen: bool, units: Sequence[JointUnit]) -> str:
    if solution.rejections:
        return "rejected: " + "; ".join(reason.text for reason in solution.rejections)
    distance = f"{math.degrees(solution.distance_rad):.1f} {names(units)} from the previous posture"
    return f"chosen, {distance}" if chosen else f"usable, {distance}"


def _short(value: float, digits: int) -> str:
    """The number without trailing zeros, and never -0."""
    return f"{round(value, digits) + 0.0:.{digits}f}".rstrip("0").rstrip(".")


def _describe_miss(miss: Miss) -> str:
    """Describe the distance; rounding counts as 0."""
    position, rotation = (0.0 if value < 1e-6 else value for value in miss)
    return f"{position:.3g} mm and {rotation:.3g} deg"


def values(answer: Answer) -> dict[str, Any]:
    """The answer as JSON values; undefined angles are null."""
    target = answer.target
    found: dict[str, Any] = {
        "pose": [list(row) for row in target.matrix],
        "asked": ["position", *target.fixed],
        "tolerance_mm": target.tolerance_mm,
        "tolerance_deg": target.tolerance_deg,
        "success": answer.success,
        "reason": answer.reason,
        answer.arm.texts.list_key("angles_deg"): _degrees(answer.angles_rad),
        "tool": tool_values(answer.tool),
        "miss": answer.miss._asdict(),
        "miss_driven": answer.miss_driven._asdict(),
    }
    if answer.search and (answer.success or not answer.choice):
        return found | _numerical_values(answer.search, answer.arm.texts.list_key("angles_deg"))
    assert answer.choice is not None
    return found | _closed_form_values(answer.choice)


def _closed_form_values(choice: Choice) -> dict[str, Any]:
    return {
        "method": CLOSED_FORM,
        "region": choice.region,
        "postures": choice.postures,
        "on_axis_1": choice.on_axis,
        "chosen": choice.chosen.number if choice.chosen else None,
        "solutions": [
            {
                "number": candidate.number,
                "branch": candidate.branch._asdict(),
                "angles_deg": _degrees(candidate.angles_rad)
                if math.isfinite(candidate.distance_rad)
                else None,
                "usable": not candidate.rejections,
                "rejections": _rejections(candidate.rejections),
                "singular": [SINGULAR[bit] for bit in SINGULAR if candidate.singular & bit],
            }
            for candidate in choice.candidates
        ],
    }


def _numerical_values(search: NumericalSolutions, key: str) -> dict[str, Any]:
    return {
        "method": NUMERICAL,
        "starts": search.starts,
        "leaves_joints_free": search.leaves_free,
        "chosen": 1 if search.chosen else None,
        "solutions": [
            {
                "number": number,
                key: _degrees(solution.angles_rad),
                "usable": not solution.rejections,
                "rejections": _rejections(solution.rejections),
                "miss": solution.miss._asdict(),
            }
            for number, solution in enumerate(search.solutions, 1)
        ],
    }


def tool_values(tool: Array) -> dict[str, Any]:
    """A pose (4, 4), lengths in mm, as JSON values."""
    return {
        "position_mm": [value + 0.0 for value in tool[:3, 3].tolist()],
        "rpy_deg": list(to_rpy_deg(tool)),
        "matrix": [[value + 0.0 for value in row] for row in tool.tolist()],
    }


def _rejections(reasons: Iterable[Rejection]) -> list[dict[str, Any]]:
    return [asdict(reason) for reason in reasons]


def _degrees(angles_rad: Iterable[float]) -> list[float]:
    """Degrees without negative zeros."""
    return [math.degrees(angle) + 0.0 for angle in angles_rad]
