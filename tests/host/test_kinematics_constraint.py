"""What a target asks of the tool: how far a tool is from it, and the derivatives that the descent goes by."""

from __future__ import annotations

import math

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.kinematics import forward
from armtempo.kinematics.constraint import Constraint, Miss
from armtempo.kinematics.descent import PoseProblem, _posture, _system
from armtempo.kinematics.forward import Frame
from armtempo.kinematics.solver import PoseSolver
from armtempo.model import pose
from armtempo.model.tool_pose import APPROACH, CONSTRAINTS, Pose

from tests.host.small_arms import OFFSET_WRIST, asked

SOLVER = PoseSolver(OFFSET_WRIST)
EVERY = list(CONSTRAINTS)


def miss(wanted: Pose, stands: np.ndarray) -> Miss:
    """How far a tool with the pose ``stands`` (4, 4) is from the target."""
    x, y, z, origin = (tuple(stands[:3, column].tolist()) for column in range(4))
    return Constraint.of(wanted).miss(Frame(x, y, z, origin))


POSE = pose.from_rpy((10, 20, 30), (15, 40, -70))


@pytest.mark.parametrize("fixed", EVERY, ids=str)
def test_a_tool_at_its_target_misses_nothing(fixed: tuple[str, ...]) -> None:
    assert max(miss(asked(POSE, fixed), POSE)) < 1e-7


@pytest.mark.parametrize("fixed", EVERY, ids=str)
def test_the_position_always_counts(fixed: tuple[str, ...]) -> None:
    moved = POSE + np.array([[0, 0, 0, 3.0], [0, 0, 0, 0], [0, 0, 0, 4.0], [0, 0, 0, 0]])
    assert miss(asked(POSE, fixed), moved).position_mm == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("fixed", "rpy", "off"),
    [
        (("roll", "pitch", "yaw"), (15, 40, -60), 10.0),
        (("pitch",), (99, 43, 12), 3.0),
        (("roll",), (17, -20, 100), 2.0),
        (("yaw",), (80, 10, -75), 5.0),
        (("yaw",), (15, 40, 110), 180.0),
        (("roll", "pitch"), (15, 46, 33), 6.0),
        (("pitch", "yaw"), (-100, 47, -70), 7.0),
        ((APPROACH,), (15, 40, -70), 0.0),
        ((), (1, 2, 3), 0.0),
    ],
    ids=str,
)
def test_only_what_is_asked_for_counts(
    fixed: tuple[str, ...], rpy: tuple[float, float, float], off: float
) -> None:
    stands = pose.from_rpy((10, 20, 30), rpy)
    assert miss(asked(POSE, fixed), stands).rotation_deg == pytest.approx(off, abs=1e-6)


def test_turning_about_the_approach_costs_nothing_and_tilting_it_does() -> None:
    spun = POSE @ pose.from_rpy((0, 0, 0), (0, 0, 77))
    tilted = spun @ pose.from_rpy((0, 0, 0), (4, 0, 0))
    assert miss(asked(POSE, (APPROACH,)), spun).rotation_deg == pytest.approx(0.0, abs=1e-6)
    assert miss(asked(POSE, (APPROACH,)), tilted).rotation_deg == pytest.approx(4.0, abs=1e-6)


@pytest.mark.parametrize("fixed", EVERY, ids=str)
def test_the_gradient_is_that_of_the_cost(fixed: tuple[str, ...]) -> None:
    rng = np.random.default_rng(41)
    problem = PoseProblem(SOLVER.geometry, Constraint.of(asked(POSE, fixed)), tuple(range(6)))
    for _ in range(5):
        angles = rng.uniform(-2, 2, 6)
        _, gradient = _system(problem, _posture(problem, angles.tolist()))
        for joint in range(6):
            nudge = np.eye(6)[joint] * 1e-6
            ends = [_posture(problem, (angles + sign * nudge).tolist()).cost for sign in (1, -1)]
            slope = (ends[0] - ends[1]) / 2e-6
            assert 2.0 * gradient[joint] == pytest.approx(slope, rel=1e-5, abs=1e-3), "seed 41"


@pytest.mark.parametrize("fixed", EVERY, ids=str)
def test_at_a_solution_the_second_derivatives_are_those_of_the_cost(fixed: tuple[str, ...]) -> None:
    rng = np.random.default_rng(42)
    angles = rng.uniform(-1, 1, 6)
    stands = forward(SOLVER.geometry, angles)
    problem = PoseProblem(SOLVER.geometry, Constraint.of(asked(stands, fixed)), tuple(range(6)))
    lower, _ = _system(problem, _posture(problem, angles.tolist()))
    step = 1e-5
    for joint in range(6):
        nudge = np.eye(6)[joint] * step
        ends = [_posture(problem, (angles + sign * nudge).tolist()).cost for sign in (1, -1)]
        assert 2.0 * lower[joint][joint] == pytest.approx(sum(ends) / step**2, rel=1e-3, abs=1e-2)


def test_an_approach_of_any_length_is_a_direction() -> None:
    found = Pose.of_approach((1, 2, 3), (0, 0, -5))
    matrix = pose.checked(found.matrix)
    np.testing.assert_allclose(matrix[:3, 2], (0, 0, -1))
    assert found.constraints == 5
    rng = np.random.default_rng(43)
    for direction in rng.normal(size=(20, 3)):
        matrix = pose.checked(Pose.of_approach((1, 2, 3), direction).matrix)
        np.testing.assert_allclose(matrix[:3, 2], direction / np.linalg.norm(direction), atol=1e-12)


def test_targets_that_make_no_sense_are_refused() -> None:
    rows = tuple(map(tuple, np.eye(4).tolist()))
    with pytest.raises(
        InputError, match=r"cannot fix roll\+yaw of its orientation; it may fix nothing, roll, "
    ):
        Pose(rows, fixed=("roll", "yaw"))
    with pytest.raises(
        InputError, match=r"tolerances of 0 mm and 0\.1 deg are not allowed; give 1e-06 to 1000 mm"
    ):
        Pose(rows, tolerance_mm=0.0)
    with pytest.raises(InputError, match="tolerance_deg is nan"):
        Pose(rows, tolerance_deg=math.nan)


def test_targets_say_what_they_ask_for() -> None:
    words = [asked(POSE, fixed).words for fixed in ((), ("pitch",), ("roll", "pitch", "yaw"))]
    assert words == ["position only", "position and pitch", "whole pose"]
