"""Tables for the terminal: columns stand below their heads, however long the joints' names and numbers."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from armtempo.basics.text import aligned
from armtempo.cli import stored
from armtempo.diagnosis.finding import Finding, Level
from armtempo.model.plan import Plan
from armtempo.planning import lower_bounds
from armtempo.records import encoded_motion
from armtempo.report import run_folder, text_summary
from armtempo.report.replayed import results
from armtempo.report.run_folder import Repetition
from armtempo.report.run_reader import RunData

from tests.host import made_runs

NAMES = ("waist", "the shoulder of the arm", "elbow")


@pytest.fixture(params=[NAMES, ("a", "b", "c")])
def made(request: pytest.FixtureRequest) -> Plan:
    """The shipped plan with other names of the joints."""
    plan = made_runs.shipped_plan()
    names = dict(zip((joint.name for joint in plan.arm.driven), request.param, strict=True))
    joints = tuple(replace(joint, name=names.get(joint.name, joint.name)) for joint in plan.arm.joints)
    return replace(plan, arm=replace(plan.arm, joints=joints))


def ends(line: str) -> list[int]:
    """Where the words of a line end that two or more spaces, or its end, follow."""
    return [found.end() for found in re.finditer(r"\S(?=  |$)", line)]


def test_rows_are_filled_up_to_the_widths() -> None:
    assert aligned([("ab", "1"), ("", "23")], (4, 3)) == ["ab    1", "     23"]


def test_what_is_longer_widens_its_column() -> None:
    rows = [("joint", "s", "x"), ("a long name", "12345", "1"), ("b", "1", "1")]
    assert aligned(rows, (6, 3, 3)) == [
        "joint           s  x",
        "a long name 12345  1",
        "b               1  1",
    ]


@pytest.mark.slow
def test_a_plan_of_joints_with_long_names(made: Plan) -> None:
    table = text_summary.lines(made)[1:6]
    assert len({len(line) for line in table}) == 1
    heads, _, *rows = table
    assert all(ends(row)[1:] == ends(heads)[1:] for row in rows)
    assert [row[: len(joint.name) + 1] for row, joint in zip(rows, made.arm.driven, strict=True)] == [
        f"{joint.name} " for joint in made.arm.driven
    ]


def test_a_plan_tells_of_coarse_steps(made: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    coarse = Finding(Level.WARNING, "waist", "a step is 1.8°", "use more microsteps")
    monkeypatch.setattr(text_summary, "coarse_steps", lambda arm: [coarse])
    assert (
        text_summary.lines(made)[-1] == f"{Level.WARNING.value}: waist: a step is 1.8°; use more microsteps"
    )


def test_a_plan_tells_what_a_free_path_may_save_unless_little_or_the_job_gives_the_path(made: Plan) -> None:
    floor_s = lower_bounds.of_vias(made.via_deg, [joint.limits for joint in made.arm.driven], {}).time_s
    said = f'path = "free" may save up to {100 - 100 * floor_s / made.total_s:.0f} %: '
    assert [line.startswith(said) for line in text_summary.lines(made)].count(True) == 1
    shorter = replace(
        made,
        trajectory=replace(
            made.trajectory,
            joints=tuple(
                replace(joint, time_points_s=joint.time_points_s * (1.02 * floor_s / made.total_s))
                for joint in made.trajectory.joints
            ),
        ),
    )
    for other in (shorter, replace(made, job=replace(made.job, path="free"))):
        assert not any("may save" in line for line in text_summary.lines(other))


def test_results_and_times_of_joints_with_long_names(made: Plan) -> None:
    motion = encoded_motion.of_plan(made)
    scales = run_folder.scales(made.arm)
    steps = tuple(-1_234_567 for _ in scales)
    run = RunData(Path(), {}, scales, (), (Repetition("", commanded_steps=steps, counts=steps),))
    lines = text_summary.result_lines(results(run, made.trajectory))
    assert len({len(line) for line in lines}) == 1
    assert all(f"{joint.name} " in line for joint, line in zip(made.arm.driven, lines[2:], strict=True))
    times = stored.motion_lines(motion, [1.0] * len(scales))[3:]
    assert len({line.index(" s, up to") for line in times}) == 1
