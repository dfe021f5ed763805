"""The closed-form inverse: all eight solutions, for every arm of the class."""

from __future__ import annotations

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.kinematics import BRANCHES, Geometry, branch_of, forward, inverse, refusals
from armtempo.kinematics.inverse import CHUNK
from armtempo.kinematics.solutions import OK, WRIST_STRAIGHT
from armtempo.kinematics.solver import moved_tool_deg

from tests.host.published_arms import (
    EQ_16,
    NAMED,
    PAPER,
    PAPER_FULL_SIZE,
    TABLE_2,
    drawn,
    turned,
    worst_error,
)

ACCURACY = 1e-9


@pytest.mark.parametrize("name", NAMED)
def test_forward_of_inverse_is_the_pose(name: str) -> None:
    geometry = NAMED[name]
    angles = np.random.default_rng(3).uniform(-np.pi, np.pi, (20_000, 6))
    poses = forward(geometry, angles)
    solutions = inverse(geometry, poses)
    assert solutions.angles_rad.shape == (20_000, 8, 6)
    assert worst_error(geometry, solutions.angles_rad, poses) < ACCURACY
    # The posture that made the pose is one of the eight: none is forgotten.
    nearest = np.nanmin(
        np.where(np.isnan(solutions.angles_rad), 9.0, turned(solutions.angles_rad - angles[:, None])).max(
            axis=2
        ),
        axis=1,
    )
    assert nearest.max() < 1e-5, f"pose {nearest.argmax()} of seed 3"


@pytest.mark.parametrize("seed", range(40))
def test_any_signs_and_lengths_of_the_class(seed: int) -> None:
    rng = np.random.default_rng(seed)
    geometry = drawn(rng)
    assert refusals(geometry) == []
    angles = rng.uniform(-np.pi, np.pi, (300, 6))
    poses = forward(geometry, angles)
    found = inverse(geometry, poses).angles_rad
    assert worst_error(geometry, found, poses) < ACCURACY
    apart = np.where(np.isnan(found), 9.0, turned(found - angles[:, None])).max(axis=2).min(axis=1)
    assert apart.max() < 1e-5


def test_table_2_comes_out() -> None:
    solutions = inverse(PAPER_FULL_SIZE, EQ_16)
    assert (solutions.outcome == OK).all()
    found = solutions.angles_rad[0]
    for number, row in enumerate(TABLE_2, 1):
        apart = turned(found - np.radians(row)).max(axis=1)
        assert np.degrees(apart.min()) < 0.06, f"row {number} of Table 2"


def test_the_eight_are_distinct_and_ordered_by_branch() -> None:
    rng = np.random.default_rng(4)
    for name, geometry in NAMED.items():
        solutions = inverse(geometry, forward(geometry, rng.uniform(-np.pi, np.pi, (50, 6))))
        for found, outcome in zip(solutions.angles_rad, solutions.outcome, strict=True):
            for i in np.flatnonzero(outcome == OK):
                assert branch_of(geometry, found[i]) == BRANCHES[i], name
                others = np.delete(found, i, axis=0)
                assert np.nanmin(turned(others - found[i]).max(axis=1), initial=9.0) > 1e-6, name


def test_angles_lie_within_half_a_turn_and_are_nan_only_out_of_reach() -> None:
    geometry = drawn(np.random.default_rng(5))
    poses = forward(geometry, np.random.default_rng(6).uniform(-np.pi, np.pi, (500, 6)))
    poses[::2, :3, 3] *= 1.5
    solutions = inverse(geometry, poses)
    reached = solutions.outcome == OK
    assert reached.any()
    assert not reached.all()
    assert np.isfinite(solutions.angles_rad[reached]).all()
    assert np.isnan(solutions.angles_rad[~reached]).all()
    assert np.nanmax(np.abs(solutions.angles_rad)) <= np.pi


def test_many_poses_give_what_each_gives_alone() -> None:
    rng = np.random.default_rng(7)
    poses = forward(PAPER, rng.uniform(-np.pi, np.pi, (CHUNK + 3, 6)))
    together = inverse(PAPER, poses)
    for i in (0, 1, CHUNK - 1, CHUNK, CHUNK + 2):
        alone = inverse(PAPER, poses[i])
        np.testing.assert_allclose(together.angles_rad[i], alone.angles_rad[0], atol=1e-12)
        np.testing.assert_array_equal(together.outcome[i], alone.outcome[0])
    assert inverse(PAPER, poses[:0]).angles_rad.shape == (0, 8, 6)


def test_each_pose_may_have_its_own_previous_posture() -> None:
    straight = np.zeros((CHUNK + 5, 6))
    straight[:, 1] = -1.0
    previous = np.zeros_like(straight)
    previous[:, 3] = np.linspace(-3, 3, len(straight))
    solutions = inverse(PAPER, forward(PAPER, straight), previous)
    assert (solutions.singular[:, 0] & WRIST_STRAIGHT).all()
    np.testing.assert_allclose(solutions.angles_rad[:, 0, 3], previous[:, 3], atol=1e-12)


def changed(row: int, **lengths: float) -> Geometry:
    values = {name: list(getattr(PAPER, name)) for name in ("d", "a", "alpha", "offset")}
    for name, value in lengths.items():
        values[name][row] = value
    return Geometry(*(tuple(values[name]) for name in ("d", "a", "alpha", "offset")))


@pytest.mark.parametrize(
    ("geometry", "words"),
    [
        (changed(0, alpha=0.5), "axis 2 is not square to axis 1 (alpha1 is 28.6479 degrees, not 90 or -90)"),
        (changed(1, alpha=0.1), "the shoulder and elbow axes (2 and 3) are not parallel"),
        (changed(2, alpha=0.0), "axis 4 is not square to axis 3"),
        (changed(3, alpha=1.0), "axis 5 is not square to axis 4"),
        (changed(4, alpha=1.0), "axis 6 is not square to axis 5"),
        (
            changed(3, a=5.0),
            "the wrist is not spherical: axes 4, 5 and 6 do not meet in one point (a4 is 5, not 0)",
        ),
        (changed(4, a=5.0), "(a5 is 5, not 0)"),
        (changed(4, d=5.0), "(d5 is 5, not 0)"),
        (changed(1, a=0.0), "the upper arm has no length"),
        (Geometry(PAPER.d[:5], PAPER.a[:5], PAPER.alpha[:5], PAPER.offset[:5]), "5 joints, not 6"),
    ],
)
def test_an_arm_outside_the_class_is_refused_with_the_reason(geometry: Geometry, words: str) -> None:
    assert any(words in reason for reason in refusals(geometry))
    with pytest.raises(InputError, match="no closed-form inverse") as caught:
        inverse(geometry, np.eye(4))
    assert words in str(caught.value)


# many poses at once through the library: the same as one by one


@pytest.mark.parametrize("name", ["ar4", "paper", "parol6"])
def test_many_poses_are_solved_as_one_by_one(name: str) -> None:
    arm, rng = armtempo.Arm.load(name), np.random.default_rng(2)
    low, high = np.array([joint.range_deg for joint in arm.joints]).T
    poses = armtempo.forward(arm, rng.uniform(low, high, (12, len(low))))
    poses[10:, :3, 3] *= 5.0  # out of reach
    near = 0.25 * (3.0 * low + high)
    found = armtempo.inverse_many(arm, poses, near)
    for number, pose in enumerate(poses[:10]):
        one = armtempo.inverse(arm, pose, near)
        usable = sorted(tuple(each.angles_deg) for each in one if each.usable)
        assert np.array(sorted(map(tuple, found.angles_deg[number][found.usable[number]]))) == pytest.approx(
            np.array(usable), abs=1e-7
        )
        assert found.nearest_deg[number] == pytest.approx(one[0].angles_deg, abs=1e-7)
    assert not found.usable[10:].any()
    assert np.isnan(found.nearest_deg[10:]).all()
    assert found.angles_deg.shape == (12, 8, len(low))


def test_rounded_poses_are_put_right_and_the_first_wrong_one_is_named() -> None:
    arm = armtempo.Arm.load("ar4")
    pose = armtempo.forward(arm, [10.0, 20.0, 30.0, 40.0, 50.0, 60.0])
    rounded = np.round(pose, 4)
    found = armtempo.inverse_many(arm, [pose[:3], rounded[:3]])
    assert found.nearest_deg[0] == pytest.approx(found.nearest_deg[1], abs=0.1)
    wrong = np.stack([pose, 2.0 * pose])
    with pytest.raises(armtempo.InputError, match="pose 2"):
        armtempo.inverse_many(arm, wrong)
    with pytest.raises(armtempo.InputError, match="are not a list of poses"):
        armtempo.inverse_many(arm, pose)
    with pytest.raises(armtempo.InputError, match="no closed-form"):
        armtempo.inverse_many("community", [pose])


# the postures that bring the tool to another place


STEP_MM = np.array([-20.0, 10.0, -20.0])


@pytest.mark.parametrize("name", ["paper", "ar4"])
def test_each_posture_has_the_tool_there(name: str) -> None:
    arm = armtempo.Arm.of(name)
    home = np.array(arm.home_deg)
    before = armtempo.forward(arm, home)
    found = moved_tool_deg(arm, home, (before[:3, 3] + STEP_MM).tolist())
    ways = [float(np.linalg.norm(posture - home)) for posture in found]
    assert ways == sorted(ways)
    assert (len(found) > 1) == (len(arm.driven) == 6)
    for posture in found:
        assert arm.angles_problem(posture) == ""
        after = armtempo.forward(arm, posture)
        np.testing.assert_allclose(after[:3, 3] - before[:3, 3], STEP_MM, atol=0.1)
        if len(arm.driven) == 6:
            np.testing.assert_allclose(after[:3, :3], before[:3, :3], atol=1e-6)


def test_a_place_out_of_reach_is_refused() -> None:
    arm = armtempo.Arm.paper()
    with pytest.raises(armtempo.PlanError, match="no posture reaches"):
        moved_tool_deg(arm, np.array(arm.home_deg), (5000.0, 0.0, 0.0))
