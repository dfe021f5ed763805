"""A joint that a parallelogram turns: its angle is counted from the link before the previous one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.kinematics import Geometry, PoseSolver, all_frames, forward
from armtempo.kinematics.forward import array_frames
from armtempo.kinematics.shape import refusals
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import Pose

ARM = Arm.load("community")
SOLVER = PoseSolver(ARM)
GEOMETRY = SOLVER.geometry
SEED = 7


def postures(count: int) -> np.ndarray:  # type: ignore[type-arg]
    """Postures within the ranges, (count, joints) in rad."""
    low, high = SOLVER.ranges.low, SOLVER.ranges.high
    return np.random.default_rng(SEED).uniform(low, high, (count, len(low)))


def test_the_forearm_keeps_its_angle_when_the_arm_before_it_turns() -> None:
    still, moved = np.radians([[0.0, 0.0, 100.0, 0.0], [0.0, 30.0, 100.0, 0.0]])
    along = [forward(GEOMETRY, angles)[:3, 3] for angles in (still, moved)]
    elbow = [120 * np.array([np.sin(low), 0.0, np.cos(low)]) for low in (0.0, np.radians(30.0))]
    np.testing.assert_allclose(along[1] - along[0], elbow[1] - elbow[0], atol=1e-9)


@pytest.mark.parametrize("moving", [(0, 1, 2), (0, 1, 2, 3), (1,), (2, 3)])
def test_the_descent_knows_how_the_cost_changes(moving: tuple[int, ...]) -> None:
    """Its gradient against differences of its cost, whichever joints move."""
    from armtempo.kinematics.constraint import Constraint
    from armtempo.kinematics.descent import PoseProblem, _posture, _system

    aim, *others = postures(6)
    constraint = Constraint.of(Pose.of_matrix(forward(GEOMETRY, aim)))
    problem = PoseProblem(GEOMETRY, constraint, moving)
    step = 1e-6
    for angles in others:
        _, gradient = _system(problem, _posture(problem, angles.tolist()))
        by_differences = [
            (
                _posture(problem, (angles + step * unit).tolist()).cost
                - _posture(problem, (angles - step * unit).tolist()).cost
            )
            / (4 * step)
            for unit in np.eye(4)[list(moving)]
        ]
        np.testing.assert_allclose(gradient, by_differences, rtol=1e-6, atol=1e-3 * max(map(abs, gradient)))


@pytest.mark.slow
def test_the_solver_finds_its_postures() -> None:
    """Position only: the hand, which the rods keep level, follows from it."""
    for angles in postures(10):
        angles[3] = 0.0
        pose = forward(GEOMETRY, angles)
        for wanted in (Pose.of_matrix(pose), Pose.of_angles(pose[:3, 3].tolist(), {})):
            answer = SOLVER.solve(wanted, np.radians([0, 10, 100, 0]).tolist())
            assert answer.success, answer.reason
            np.testing.assert_allclose(answer.tool[:3, 3], pose[:3, 3], atol=1e-5)
            np.testing.assert_allclose(answer.angles_rad, angles, atol=1e-6)
            near = SOLVER.nearest(wanted, answer.angles_rad)
            assert near.success
            np.testing.assert_allclose(near.angles_rad, angles, atol=1e-6)


def test_the_closed_form_refuses_it() -> None:
    geometry = Geometry.of(Arm.load("parol6"))
    assert refusals(geometry) == []
    assert refusals(replace(geometry, linked=(2,))) == ["a parallel linkage turns joint 3"]


def test_floats_and_arrays_of_any_shape_turn_alike() -> None:
    angles = postures(10).reshape(2, 5, 4)
    found = array_frames(GEOMETRY, angles)
    for place in np.ndindex(2, 5):
        one = all_frames(GEOMETRY, angles[place].tolist())
        for frame, wanted in zip(found, one, strict=True):
            for column, axis in enumerate(frame):
                np.testing.assert_allclose([part[place] for part in axis], wanted[:3, column], atol=1e-12)
    turns = GEOMETRY.turns([0.1, 0.2, 0.4, 0.8])
    np.testing.assert_allclose(turns, [0.1, 0.2, 0.2, 0.4])
    assert GEOMETRY.linked == (2, 3)
