"""The automatic choice, the placing of angles within ranges, and the reasons against the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.kinematics import BRANCHES, Branch, Geometry, Ranges, branch_of, choose, forward
from armtempo.kinematics.choice import Choice
from armtempo.model.arm import Arm

from tests.host.published_arms import NAMED, PAPER, PUBLISHED, SHAPE, with_wrist_at

ARM = Arm.paper()
RANGES = Ranges.of(ARM)
ANY = Ranges(np.full(6, -2 * np.pi), np.full(6, 2 * np.pi))
HOME = np.radians([joint.home_deg for joint in ARM.joints])


def ranges_deg(*ends: tuple[float, float]) -> Ranges:
    low, high = np.radians(ends).T
    return Ranges(low, high)


@pytest.mark.parametrize(
    ("angle", "previous", "ends", "placed"),
    [
        (170.0, -170.0, (-180.0, 180.0), 170.0),  # the near turn, -190, is out of range
        (170.0, -170.0, (-200.0, 200.0), -190.0),
        (170.0, -170.0, (-180.0, 600.0), 170.0),
        (10.0, 700.0, (-360.0, 720.0), 370.0 + 360.0 - 360.0),
        (10.0, 700.0, (-360.0, 730.0), 730.0),
        (-170.0, 0.0, (100.0, 200.0), 190.0),
        (90.0, 0.0, (-30.0, 30.0), 90.0),  # does not fit: nearest to the range
        (350.0, 0.0, (-180.0, 180.0), -10.0),
        (200.0, 0.0, (-90.0, 90.0), -160.0),
        (5.0, 0.0, (5.0 + 1e-9, 10.0), 5.0 + 1e-9),  # rounding is put right
    ],
)
def test_whole_turns_bring_an_angle_into_range_nearest_to_the_previous(
    angle: float, previous: float, ends: tuple[float, float], placed: float
) -> None:
    (found,) = ranges_deg(ends).placed(np.radians([angle]).tolist(), np.radians([previous]).tolist())
    assert np.degrees(found) == pytest.approx(placed, abs=1e-10)


def test_excess_says_how_far_and_on_which_side() -> None:
    ranges = ranges_deg((-10.0, 20.0), (-10.0, 20.0), (-10.0, 20.0))
    found = np.degrees(ranges.excess(np.radians([-12.0, 5.0, 25.0]).tolist()))
    np.testing.assert_allclose(found, [-2.0, 0.0, 5.0], atol=1e-12)


def test_the_chosen_solution_is_the_nearest_that_can_be_used() -> None:
    rng = np.random.default_rng(12)
    for name, (geometry, ranges) in PUBLISHED.items():
        for _ in range(40):
            angles = rng.uniform(ranges.low, ranges.high)
            previous = rng.uniform(ranges.low, ranges.high)
            choice = choose(geometry, forward(geometry, angles), ranges, previous, "m")
            assert choice.chosen is not None, name
            chosen = choice.chosen.angles_rad
            assert (chosen >= ranges.low).all()
            assert (chosen <= ranges.high).all()
            np.testing.assert_allclose(
                forward(geometry, chosen), forward(geometry, angles), atol=1e-9 * geometry.reach
            )
            way = np.linalg.norm(chosen - previous)
            assert way == pytest.approx(choice.chosen.distance_rad)
            assert way <= np.linalg.norm(angles - previous) + 1e-9
            for candidate in choice.candidates:
                assert bool(candidate.rejections) or candidate.distance_rad >= way - 1e-12


def test_staying_where_the_arm_stands_costs_nothing() -> None:
    rng = np.random.default_rng(13)
    for geometry in NAMED.values():
        angles = rng.uniform(-np.pi, np.pi, 6)
        choice = choose(geometry, forward(geometry, angles), ANY, angles)
        assert choice.chosen is not None
        np.testing.assert_allclose(choice.chosen.angles_rad, angles, atol=1e-7)


def test_paper_s_last_via_point_is_chosen_from_table_2() -> None:
    pose = forward(PAPER, np.radians([180.0, -38.0, -52.0, 0.0, 0.0, 0.0]))
    choice = choose(PAPER, pose, RANGES, np.radians([160.0, -45.0, -20.0, 0.0, 0.0, 0.0]))
    assert (choice.region, choice.postures, choice.on_axis) == ("II", 4, False)
    assert choice.chosen is not None
    assert choice.chosen.number == 1
    np.testing.assert_allclose(np.degrees(choice.chosen.angles_rad), [180, -38, -52, 0, 0, 0], atol=1e-9)
    rejected = [candidate for candidate in choice.candidates if candidate.rejections]
    assert [candidate.number for candidate in rejected] == [7, 8]
    reason = rejected[0].rejections[0]
    assert (reason.kind, reason.joint) == ("range", 2)
    # 168.3 degrees of Table 2 or a turn less, -191.7: the latter misses the range -170 to 10 by less.
    assert reason.amount == pytest.approx(-21.662, abs=1e-3)
    assert reason.text == "joint 2 at -191.7 deg is 21.66 deg below its range -170 to 10"


def test_every_joint_out_of_range_is_named() -> None:
    angles = np.radians([30.0, -60.0, 40.0, 20.0, 50.0, 60.0])
    narrow = ranges_deg((-10, 10), (-90, 0), (-90, 90), (40, 50), (-90, 90), (-90, 55))
    choice = choose(PAPER, forward(PAPER, angles), narrow, np.zeros(6))
    assert choice.chosen is None
    reasons = choice.candidates[0].rejections
    assert [reason.joint for reason in reasons] == [1, 4, 6]
    np.testing.assert_allclose([reason.amount for reason in reasons], [20.0, -20.0, 5.0], atol=1e-9)


def unreachable(choice: Choice, number: int) -> tuple[float, int | None]:
    (reason,) = choice.candidates[number - 1].rejections
    assert reason.kind == "unreachable"
    assert f"by {reason.amount:.6g} mm" in reason.text
    return reason.amount, reason.inequality


@pytest.mark.parametrize(
    ("planar", "up", "number", "amount", "line"),
    [
        (SHAPE.farthest + 150.0, 0.0, 1, 250.0, 1),  # the front shoulder is 100 behind axis 1
        (SHAPE.farthest + 150.0, 0.0, 5, 50.0, 1),
        (100.0, -SHAPE.farthest - 30.0, 5, 30.0, 2),
        (100.0, SHAPE.farthest + 30.0, 5, 30.0, 3),
        (100.0, 5.0, 5, SHAPE.nearest - 5.0, 4),
    ],
)
def test_unreachable_names_the_line_of_eq_3(
    planar: float, up: float, number: int, amount: float, line: int
) -> None:
    choice = choose(PAPER, with_wrist_at(planar, up), RANGES, HOME)
    assert unreachable(choice, number) == (pytest.approx(amount, rel=1e-9), line)
    assert f"(Eq. (3), line {line})" in choice.candidates[number - 1].rejections[0].text


def test_unreachable_within_the_shoulder_offset() -> None:
    pose = np.eye(4)
    pose[:3, 3] = 0.1, 0.0, 0.9
    choice = choose(NAMED["puma_560"], pose, ANY, np.zeros(6), "m")
    (reason,) = choice.candidates[0].rejections
    assert reason.amount == pytest.approx(0.05005)
    assert "by 0.05005 m: wrist centre 0.1 m from axis 1" in reason.text


def test_duplicates_name_their_twin() -> None:
    choice = choose(PAPER, with_wrist_at(SHAPE.farthest - 100.0, 0.0), ANY, HOME)
    assert [candidate.rejections[0].twin for candidate in choice.candidates[2:4]] == [1, 2]
    puma = NAMED["puma_560"]
    pose = np.eye(4)
    pose[:3, 3] = puma.d[2], 0.0, 0.9
    choice = choose(puma, pose, ANY, np.zeros(6), "m")
    for candidate in choice.candidates[4:]:
        (reason,) = candidate.rejections
        assert reason.kind == "duplicate"
        assert reason.twin is not None
        twin = choice.candidates[reason.twin - 1]
        np.testing.assert_allclose(
            np.exp(1j * twin.angles_rad), np.exp(1j * candidate.angles_rad), atol=1e-12
        )


def test_branch_of_an_arm_between_two_branches_is_left_open() -> None:
    straight = branch_of(PAPER, np.radians([0.0, -60.0, 40.0, 0.0, 0.0, 0.0]))
    assert straight == Branch("front", "up", "")
    assert str(straight) == "front up"
    assert straight.differs(BRANCHES[0]) == ()
    assert BRANCHES[0].differs(BRANCHES[7]) == ("base", "elbow", "wrist")


def test_branches_do_not_depend_on_the_sign_of_a2() -> None:
    flipped = replace(
        PAPER, a=(PAPER.a[0], -PAPER.a[1], *PAPER.a[2:]), offset=(0.0, np.pi, np.pi, 0.0, 0.0, 0.0)
    )
    assert isinstance(flipped, Geometry)
    rng = np.random.default_rng(14)
    for angles in rng.uniform(-np.pi, np.pi, (20, 6)):
        np.testing.assert_allclose(forward(flipped, angles), forward(PAPER, angles), atol=1e-9)
        assert branch_of(flipped, angles) == branch_of(PAPER, angles)
