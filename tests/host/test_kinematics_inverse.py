"""Forward kinematics, and closed-form inverse: all eight solutions for every arm of the class, by arrays and floats."""

from __future__ import annotations

import armtempo
import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.kinematics import (
    BRANCHES,
    Geometry,
    branch_of,
    forward,
    inverse,
    inverse_of_pose,
    postures,
    refusals,
)
from armtempo.kinematics.inverse import CHUNK
from armtempo.kinematics.shape import Shape
from armtempo.kinematics.solutions import DUPLICATE, ELBOW_STRETCHED, OK, WRIST_STRAIGHT
from armtempo.kinematics.solver import moved_tool_deg

from tests.host.arms import (
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
ANY_ARM = [*NAMED, *range(12)]
"""Names of published arms, and seeds of drawn ones."""


def given(arm: str | int) -> tuple[Geometry, np.random.Generator]:
    """One of ``ANY_ARM``, and the generator that goes on."""
    rng = np.random.default_rng(3 if isinstance(arm, str) else arm)
    return (NAMED[arm] if isinstance(arm, str) else drawn(rng)), rng


@pytest.mark.parametrize("arm", ANY_ARM)
def test_forward_of_inverse_is_the_pose(arm: str | int) -> None:
    """And the posture that made the pose is one of the eight: none is forgotten."""
    geometry, rng = given(arm)
    assert refusals(geometry) == []
    angles = rng.uniform(-np.pi, np.pi, (2000 if arm == "paper" else 500, 6))
    poses = forward(geometry, angles)
    found = inverse(geometry, poses).angles_rad
    assert worst_error(geometry, found, poses) < ACCURACY
    apart = np.where(np.isnan(found), 9.0, turned(found - angles[:, None])).max(axis=2).min(axis=1)
    assert apart.max() < 1e-5, f"pose {apart.argmax()} of {arm}"


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
    with pytest.raises(InputError, match="no closed-form inverse"):
        inverse_of_pose(geometry, np.eye(4).ravel().tolist())


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


@pytest.mark.slow
def test_many_poses_of_an_arm_without_a_closed_form_are_solved_too() -> None:
    """One with a sliding joint, also out of reach."""
    arm = armtempo.Arm.load("scara_z")
    near = np.array(arm.home_deg) + 3.0
    poses = np.array([armtempo.forward(arm, near), armtempo.forward(arm, near)])
    poses[1, :3, 3] *= 9.0
    found = armtempo.inverse_many(arm, poses, near)
    assert found.angles_deg.shape == (2, 8, 4)
    assert found.nearest_deg[0] == pytest.approx(near, abs=1e-4)
    one = armtempo.inverse(arm, poses[0], near)
    assert np.array(found.angles_deg[0][found.usable[0]]) == pytest.approx(
        np.array([each.angles_deg for each in one if each.usable]), abs=1e-7
    )
    assert not found.usable[1].any()
    assert np.isnan(found.nearest_deg[1]).all()


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


# forward kinematics, and one pose by floats: the same answers as by arrays, also on borders and singular poses


EQUAL = 1e-12


def both_ways(geometry: Geometry, poses: np.ndarray, previous: np.ndarray) -> float:
    """Largest difference of an angle, whole turns aside; outcomes and singular bits must be the same."""
    together = inverse(geometry, poses, np.tile(previous, (len(poses), 1)))
    alone = [inverse_of_pose(geometry, pose.ravel().tolist(), previous.tolist()) for pose in poses]
    np.testing.assert_array_equal(together.outcome, [each.outcome for each in alone])
    np.testing.assert_array_equal(together.singular, [each.singular for each in alone])
    angles = np.array([each.angles_rad for each in alone])
    np.testing.assert_array_equal(np.isnan(angles), np.isnan(together.angles_rad))
    assert np.nanmax(np.abs(angles)) <= np.pi
    return float(np.nanmax(turned(angles - together.angles_rad), initial=0.0))


def special_angles(geometry: Geometry, rng: np.random.Generator) -> np.ndarray:
    """Postures (N, 6) with a straight wrist, and with the elbow stretched and folded, ever more exactly."""
    shape = Shape.of(geometry)
    angles = rng.uniform(-np.pi, np.pi, (60, 6))
    nudges = np.tile([0.0, 1e-15, 1e-12, 1e-11, 1e-9, 1e-8, 1e-7, 1e-6, 1e-4, 1e-2], 2)
    angles[:20, 4] = nudges - geometry.offset[4]
    for part, fold in ((slice(20, 40), 0.0), (slice(40, 60), np.pi)):
        angles[part, 2] = shape.sign2 * (nudges + fold - shape.bend) - geometry.offset[2]
    return angles


@pytest.mark.parametrize("arm", ANY_ARM)
def test_arrays_and_floats_give_the_same(arm: str | int) -> None:
    geometry, rng = given(arm)
    angles = np.concatenate((rng.uniform(-np.pi, np.pi, (150, 6)), special_angles(geometry, rng)))
    poses = forward(geometry, angles)
    poses[:150:3, :3, 3] *= 1.4  # some of them out of reach
    assert both_ways(geometry, poses, rng.uniform(-3, 3, 6)) < EQUAL


def test_on_axis_1_and_on_the_border_of_the_offset_too() -> None:
    previous = np.array([0.7, -0.3, 0.2, 1.1, 0.5, -0.4])
    up = np.eye(4)
    up[:3, 3] = 0.0, 0.0, 520.0
    assert both_ways(PAPER, up[None], previous) < EQUAL
    puma = NAMED["puma_560"]
    border, within = np.eye(4), np.eye(4)
    border[:3, 3] = puma.d[2] * np.cos(0.9), puma.d[2] * np.sin(0.9), 0.9
    within[:3, 3] = 0.1, 0.0, 0.9
    assert both_ways(puma, np.stack((border, within)), previous) < EQUAL


def test_inverse_of_one_matrix_gives_arrays_of_the_usual_shape() -> None:
    solutions = inverse(PAPER, forward(PAPER, [0.3, -1.0, 0.7, 0.1, 0.5, 0.2]))
    assert solutions.angles_rad.shape == (1, 8, 6)
    assert solutions.outcome.shape == solutions.singular.shape == (1, 8)
    assert solutions.outcome.dtype == np.uint8


@pytest.mark.parametrize("bend", [1e-2, 1e-4, 1e-5, 1e-6, -1e-6])
@pytest.mark.parametrize("folded", [False, True])
def test_elbow_up_and_down_are_two_solutions_from_1e_6_rad_on(bend: float, folded: bool) -> None:
    """Both lead to the pose within 1e-9; the elbow's angle itself is only as sharp as the pose's rounding."""
    rng = np.random.default_rng(21)
    for name, geometry in NAMED.items():
        shape = Shape.of(geometry)
        if folded and shape.nearest < 0.01 * shape.farthest:
            continue  # folds onto its shoulder: r is then 0, and not flat about it
        angles = rng.uniform(-np.pi, np.pi, (15, 6))
        angles[:, 2] = shape.sign2 * (bend + folded * np.pi - shape.bend) - geometry.offset[2]
        poses = forward(geometry, angles)
        solutions = inverse(geometry, poses)
        assert worst_error(geometry, solutions.angles_rad, poses) < 1e-9, name
        for i, found in enumerate(solutions.angles_rad):
            near = turned(found[:, 2] - angles[i, 2]) < 2.5 * abs(bend)
            # With the shoulder on axis 1 the rear arm is as stretched as the front one.
            assert near.sum() == (4 if shape.shoulder else 8), name
            assert (solutions.outcome[i, near] == OK).all(), name
            assert not (solutions.singular[i, near] & ELBOW_STRETCHED).any()
            elbows = shape.sign2 * (found[near, 2] + geometry.offset[2]) + shape.bend - folded * np.pi
            apart = np.sort(np.remainder(elbows + np.pi, 2 * np.pi) - np.pi)
            np.testing.assert_allclose(np.abs(apart), abs(bend), atol=1e-8 + 3e-15 / abs(bend))
            assert (np.sign(apart) == np.repeat([-1, 1], near.sum() // 2)).all()


def test_a_stretched_elbow_is_one_solution_whatever_rounding_does() -> None:
    rng = np.random.default_rng(22)
    for geometry in NAMED.values():
        shape = Shape.of(geometry)
        angles = rng.uniform(-np.pi, np.pi, (200, 6))
        angles[:, 2] = -shape.sign2 * shape.bend - geometry.offset[2]
        outcome = inverse(geometry, forward(geometry, angles)).outcome
        assert ((outcome == DUPLICATE).sum(axis=1) == (2 if shape.shoulder else 4)).all()


def product(geometry: Geometry, angles: np.ndarray) -> np.ndarray:
    """The transform of each row written out, multiplied."""
    pose = np.eye(4)
    for d, a, alpha, offset, angle in zip(
        geometry.d, geometry.a, geometry.alpha, geometry.offset, angles, strict=True
    ):
        c, s, ca, sa = np.cos(angle + offset), np.sin(angle + offset), np.cos(alpha), np.sin(alpha)
        pose = pose @ [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
    return pose


def test_first_row_of_table_2_gives_every_printed_digit_of_eq_16() -> None:
    pose = forward(PAPER_FULL_SIZE, np.radians(TABLE_2[0]))
    np.testing.assert_allclose(pose, EQ_16, atol=5e-4)


@pytest.mark.parametrize("row", TABLE_2)
def test_each_row_of_table_2_gives_eq_16_within_the_rounding_of_its_angles(row: tuple[float, ...]) -> None:
    pose = forward(PAPER_FULL_SIZE, np.radians(row))
    # Printed to 0.05 degrees each; the reach is 460 cm.
    np.testing.assert_allclose(pose[:3, :3], EQ_16[:3, :3], atol=3 * np.radians(0.1))
    np.testing.assert_allclose(pose[:3, 3], EQ_16[:3, 3], atol=460 * 2 * np.radians(0.05))


@pytest.mark.parametrize("name", NAMED)
def test_forward_is_the_product_of_the_rows(name: str) -> None:
    rng = np.random.default_rng(1)
    for angles in rng.uniform(-np.pi, np.pi, (20, 6)):
        pose = product(NAMED[name], angles)
        np.testing.assert_allclose(forward(NAMED[name], angles), pose, atol=1e-14 * NAMED[name].reach + 1e-14)


def test_any_geometry_and_any_batch_shape() -> None:
    rng = np.random.default_rng(2)
    geometry = drawn(rng)
    angles = rng.uniform(-np.pi, np.pi, (2, 3, 6))
    poses = forward(geometry, angles)
    assert poses.shape == (2, 3, 4, 4)
    np.testing.assert_allclose(poses[1, 2], product(geometry, angles[1, 2]), atol=1e-14)
    assert forward(geometry, angles[:0]).shape == (0, 3, 4, 4)


def test_arms_with_another_number_of_joints() -> None:
    planar = Geometry((0.0, 0.0), (3.0, 4.0), (0.0, 0.0), (0.0, 0.0))
    np.testing.assert_allclose(forward(planar, [0.0, np.pi / 2])[:3, 3], [3, 4, 0], atol=1e-15)


def test_postures_are_the_origins_from_base_to_tool() -> None:
    angles = np.radians([0.0, -60.0, 40.0, 0.0, 0.0, 0.0])
    points = postures(PAPER, np.stack([angles, angles]))
    assert points.shape == (2, 7, 3)
    np.testing.assert_array_equal(points[0, 0], 0.0)
    np.testing.assert_allclose(points[0, 1], [-100.0, 0.0, 130.0], atol=1e-12)
    np.testing.assert_allclose(points[0, 6], forward(PAPER, angles)[:3, 3], atol=1e-12)
    lengths = np.linalg.norm(np.diff(points[0], axis=0), axis=1)
    np.testing.assert_allclose(lengths, [np.hypot(130, 100), 300, 120, 360, 0, 40], atol=1e-12)
