"""Via points less than a step apart are one, and nothing that was asked of them is lost."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo import pipeline
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.model.job import Job, Stop
from armtempo.model.tool_pose import Pose
from armtempo.model.tool_segment import ToolSegment
from armtempo.planning import planner

ARM = Arm.paper()
STEP = 1.0 / ARM.driven[0].steps_per_deg
HERE, THERE, END = (20.0, -60.0, 40.0), (50.0, -60.0, 40.0), (120.0, -60.0, 40.0)
QUICK: Any = {"path": "through", "timing": "shared", "refine": 1, "starts": 1, "optimiser": "gradient"}


def beside(place: tuple[float, ...], steps: float = 0.6) -> tuple[float, ...]:
    return (place[0] + steps * STEP, *place[1:])


def test_a_spline_passes_them_as_one_and_says_so() -> None:
    twice = Job("twice", via=(HERE, beside(HERE), END), **QUICK)
    once = replace(twice, via=(HERE, END))
    plan, right = planner.plan(ARM, twice), planner.plan(ARM, once)
    assert plan.notes == (
        "P0 and P1 are less than a step apart, and planned as one point, P0 at 20, -60, 40°; later via points "
        "count from it",
    )
    assert plan.job == once
    assert np.array_equal(plan.via_deg, right.via_deg)
    assert plan.total_s == right.total_s


@pytest.mark.parametrize(
    ("via", "groups"),
    [
        ((HERE, THERE, beside(THERE), END), [[0], [1, 2], [3]]),
        ((HERE, THERE, beside(THERE), beside(THERE, 1.2), END), [[0], [1, 2], [3], [4]]),  # none creeps along
        ((HERE, beside(HERE), END), [[0, 1], [2]]),
        ((HERE, THERE, beside(END, -0.6), END), [[0], [1], [2, 3]]),
        ((HERE, beside(END, -1.2), beside(END, -0.6), END), [[0], [1, 2], [3]]),
        ((HERE, beside(END, -0.8), beside(END, -0.6), END), [[0], [1, 2, 3]]),
        ((HERE, beside(HERE, 0.2), beside(HERE, 0.4)), [[0, 1], [2]]),  # the ends are two
        ((HERE, beside(HERE, 1.1), END), [[0], [1], [2]]),
    ],
)
def test_which_are_one(via: tuple[tuple[float, ...], ...], groups: list[list[int]]) -> None:
    job, _, notes = planner.merged(ARM, Job("some", via=via), np.array(via))
    last = len(via) - 1
    assert job.via == tuple(via[last if last in group else group[0]] for group in groups)
    assert len(notes) == sum(len(group) > 1 for group in groups)


def test_no_other_job_is_changed() -> None:
    job = Job.paper()
    via, _ = planner.via_angles(ARM, job)
    assert planner.merged(ARM, job, via).job is job


def test_stops_stay_and_rests_add_up() -> None:
    via = (HERE, THERE, beside(THERE), END, HERE)
    job = Job("rests", via=via, stops=(Stop(1, 0.5), Stop(2, 0.25), Stop(3)))
    found, _, notes = planner.merged(ARM, job, np.array(via))
    assert found.stops == (Stop(1, 0.75), Stop(2))
    assert "with 0.75 s of rest" in notes[0]
    assert planner.merged(ARM, replace(job, stops=(Stop(2),)), np.array(via)).job.stops == (Stop(1),)


def test_a_stop_at_an_end_is_not_lost() -> None:
    via = (HERE, beside(HERE), END)
    assert not planner.merged(ARM, Job("ends", via=via, stops=(Stop(1),)), np.array(via)).job.stops
    with pytest.raises(InputError, match="so they are one point, but the dwell_s of P1 is not at an end"):
        planner.merged(ARM, Job("ends", via=via, stops=(Stop(1, 1.0),)), np.array(via))
    back = via[::-1]
    with pytest.raises(InputError, match=r"P1 and P2 .* dwell_s of P1"):
        planner.merged(ARM, Job("ends", via=back, stops=(Stop(1, 1.0),)), np.array(back))


@pytest.mark.parametrize(
    ("before", "between", "message"),
    [
        ({}, {"speed_mm_s": 20.0}, "speed_mm_s of P2"),
        ({"speed_mm_s": 30.0}, {"speed_mm_s": 20.0}, "speed_mm_s of P2"),
        ({"line": True}, {"line": True, "acceleration_mm_s2": 20.0}, "acceleration_mm_s2 of P2"),
        ({"line": True, "blend_mm": 5.0}, {"line": True}, "blend_mm of P2"),
        ({"line": True}, {"line": True, "blend_mm": 5.0}, "blend_mm of P2"),
        ({"line": True, "speed_mm_s": 20.0}, {"line": True, "speed_mm_s": 20.0}, ""),
        ({"line": True, "speed_mm_s": 20.0}, {}, ""),
        ({"line": True, "blend_mm": 5.0}, {"line": True, "blend_mm": 5.0}, ""),
    ],
)
def test_what_is_asked_of_the_tool_stays(
    before: dict[str, object], between: dict[str, object], message: str
) -> None:
    via = (HERE, THERE, beside(THERE), END)
    ways = {1: before, 2: between, 3: {"line": True}}
    segments = tuple(ToolSegment(number, **way) for number, way in ways.items() if way)  # type: ignore[arg-type]
    job = Job("tool", via=via, tool_segments=segments)
    if message:
        with pytest.raises(InputError, match=message):
            planner.merged(ARM, job, np.array(via))
        return
    found = planner.merged(ARM, job, np.array(via)).job
    assert found.tool_segments == (ToolSegment(1, **before), ToolSegment(2, line=True))  # type: ignore[arg-type]


def test_circles_and_wide_poses_are_no_such_points() -> None:
    via = (HERE, THERE, beside(THERE), END)
    circle = ToolSegment(2, line=True, circle_through_mm=((1.0, 2.0, 3.0), (3.0, 2.0, 1.0)))
    job = Job("circle", via=via, tool_segments=(circle,))
    assert planner.merged(ARM, job, np.array(via))[0] is job
    pose = Pose(matrix=tuple(map(tuple, np.eye(4).tolist())), tolerance_mm=5.0, tolerance_deg=5.0)
    wide = Job("wide", via=(HERE, pose, beside(THERE), END))
    assert planner.merged(ARM, wide, np.array(via))[0] is wide
    assert len(planner.merged(ARM, replace(wide, path="through"), np.array(via)).job.via) == 3


def test_a_job_is_split_at_its_merged_stops() -> None:
    via = (HERE, beside(HERE), THERE, beside(THERE), END)
    job = Job("legs", via=via, stops=(Stop(3),), **QUICK)
    parts = pipeline.split(ARM, job)
    assert [part.job.via for part in parts] == [(HERE, THERE), (THERE, END)]


@pytest.mark.slow
def test_a_recording_that_creeps_is_thinned_to_points_that_stay(tmp_path: Path) -> None:
    """It halts for a moment at each place, where via points by time come close."""
    rng = np.random.default_rng(6)
    places = np.array(HERE) + rng.uniform(-20.0, 20.0, (4, 3))
    u = np.linspace(0.0, 1.0, 150, endpoint=False)[:, None]
    shape = 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5
    rows = np.concatenate([*(one + (two - one) * shape for one, two in pairwise(places)), places[-1:]])
    table = np.column_stack([0.01 * np.arange(len(rows)), rows])
    file = tmp_path / "creeps.csv"
    np.savetxt(file, table, delimiter=",", header="time_s,joint 1,joint 2,joint 3", comments="", fmt="%.6f")
    job = Job.from_csv(file, ARM, tolerance_deg=0.02)
    via, _ = planner.via_angles(ARM, job)
    assert planner.merged(ARM, job, via).job is job
