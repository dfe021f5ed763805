"""The trajectory file: whole, repeatable, and refused if it is not what it should be."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.model import plan_file
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.tool_pose import Pose
from armtempo.planning import planner

from tests.plans import changed

ARM = Arm.paper()
JOB = replace(Job.paper(ARM), iterations=20, parameters={"a": 0.5, "variant": "paper"})


@pytest.fixture(scope="module")
def plan() -> Plan:
    return planner.plan(ARM, JOB)


@pytest.fixture
def path(plan: Plan, tmp_path: Path) -> Path:
    plan.save(tmp_path / "feed.json")
    return tmp_path / "feed.json"


def test_comes_back_to_the_last_bit(plan: Plan, path: Path) -> None:
    loaded = Plan.load(path)
    assert loaded.arm == plan.arm
    assert loaded.job == plan.job
    assert loaded.versions == plan.versions
    assert loaded.extremes == plan.extremes
    for one, two in zip(loaded.trajectory.joints, plan.trajectory.joints, strict=True):
        assert np.array_equal(one.angle_points_deg, two.angle_points_deg)
        assert np.array_equal(one.time_points_s, two.time_points_s)
    again = path.with_name("again.json")
    loaded.save(again)
    assert again.read_bytes() == path.read_bytes()


def test_is_enough_to_plan_again(path: Path) -> None:
    loaded = Plan.load(path)
    again = planner.plan(loaded.arm, loaded.job)
    for one, two in zip(loaded.trajectory.joints, again.trajectory.joints, strict=True):
        assert np.array_equal(one.time_points_s, two.time_points_s)


def test_keeps_poses(plan: Plan, tmp_path: Path) -> None:
    pose = Pose.of_angles((5.0, 6.0, 7.0), {"pitch": 20.0})
    posed = changed(plan, job=replace(plan.job, via=(plan.job.via[0], pose)))
    posed.save(tmp_path / "posed.json")
    assert Plan.load(tmp_path / "posed.json").job == posed.job


def test_reads_files_from_before_poses_had_tolerances_and_joints_linkages() -> None:
    """Written by ``armtempo plan`` of commit c418049."""
    old = Path(__file__).parents[1] / "data" / "trajectory_before_tolerances.json"
    content = json.loads(old.read_text(encoding="utf-8"))["plan"]
    assert set(content["job"]["via"][1]) == {"matrix", "posture_deg"}
    loaded = Plan.load(old)
    assert replace(loaded.arm, source=ARM.source) == ARM
    _, pose, _ = loaded.job.via
    assert pose == Pose(tuple(map(tuple, content["job"]["via"][1]["matrix"])))
    assert (pose.fixed, pose.tolerance_mm, pose.tolerance_deg) == (("roll", "pitch", "yaw"), 0.1, 0.1)
    again = planner.plan(loaded.arm, loaded.job)
    np.testing.assert_allclose(again.via_deg, loaded.via_deg, atol=1e-9)


def test_refuses_every_cut_of_the_file(path: Path, tmp_path: Path) -> None:
    content = path.read_bytes().rstrip()
    cut = tmp_path / "cut.json"
    for length in [0, 1, 10, len(content) // 2, len(content) - 2, len(content) - 1]:
        cut.write_bytes(content[:length])
        with pytest.raises(InputError, match=r"cut\.json: damaged or cut: .*plan it again"):
            Plan.load(cut)


def edited(path: Path, edit: Callable[[Any], None]) -> Path:
    """The file with its content changed, and its checksum with it."""
    content = json.loads(path.read_text(encoding="utf-8"))
    edit(content)
    if "plan" in content and "sha256" in content:
        content["sha256"] = plan_file.checksum(content["plan"])
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda c: c.update(format="gcode"), "not a trajectory file"),
        (lambda c: c.update(version=3), "version 3"),
        (lambda c: c["plan"]["job"].update(refine="some"), "'auto' or a number"),
        (
            lambda c: c["plan"]["trajectory"]["joints"][0].update(via_segments=[0, 1, 1, 3, 4, 5, 6]),
            "do not increase",
        ),
        (
            lambda c: c["plan"]["trajectory"]["joints"][0].update(via_segments=[0, 6]),
            "must name 7 via points",
        ),
        (lambda c: c.update(extra=1), "unknown or missing key"),
        (lambda c: c["plan"].update(colour="red"), "plan: unknown key colour"),
        (lambda c: c["plan"]["job"].pop("seed"), "plan.job: missing key seed"),
        (lambda c: c["plan"]["arm"]["joints"][0].pop("home_deg"), "missing key home_deg"),
        (lambda c: c["plan"]["job"].update(seed="one"), "plan.job.seed"),
        (lambda c: c["plan"]["job"].update(seed=True), "plan.job.seed"),
        (lambda c: c["plan"]["job"].update(polish=1), "plan.job.polish"),
        (lambda c: c["plan"]["arm"]["joints"][0]["limits"].update(speed_deg_s="50"), "limits"),
        (lambda c: c["plan"]["arm"]["joints"][0].update(range_deg=[1.0, 2.0, 3.0]), "range_deg"),
        (lambda c: c["plan"]["trajectory"]["joints"].pop(), "2 joints in the trajectory"),
        (lambda c: c["plan"]["trajectory"]["joints"][1]["time_points_s"].reverse(), "do not increase"),
        (lambda c: c["plan"]["trajectory"]["joints"][1]["time_points_s"].pop(), "10 time control points"),
        (
            lambda c: c["plan"]["trajectory"]["joints"][2]["angle_points_deg"].append(1.0),
            "12 angle control points",
        ),
        (lambda c: c["plan"]["trajectory"]["joints"][2].update(degree=4), "degree 4"),
        (lambda c: c["plan"]["trajectory"]["joints"][2].update(refine=0), "refine 0"),
        (lambda c: c["plan"].update(via_deg=[[1.0, 2.0], [3.0]]), "differ in length"),
        (lambda c: c["plan"].update(via_deg=["a"]), "finite numbers"),
        (lambda c: c["plan"].update(searches={}), "should be a list"),
        (lambda c: c["plan"].update(via_deg=[]), "via_deg and extremes"),
        (lambda c: c["plan"].update(extremes=[]), "via_deg and extremes"),
        (lambda c: c["plan"]["trajectory"].update(shared=True), "time control points differ"),
        (lambda c: c["plan"]["searches"][0].update(joints=[7]), "a joint that does not exist"),
        (lambda c: c["plan"]["arm"]["joints"][0].update(limits=None), "joint 1: has no limits"),
        (lambda c: c["plan"]["arm"]["joints"][0]["motor"].update(gear_ratio=0), "Motor: "),
        (lambda c: c["plan"]["arm"]["joints"][0]["encoder"].update(counts_per_rev=0), "counts_per_rev"),
        (lambda c: c["plan"]["arm"]["joints"][0].update(d_mm=10**400), "d_mm: 1000"),
    ],
)
def test_refuses_what_it_does_not_understand(path: Path, edit: Callable[[Any], None], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Plan.load(edited(path, edit))


@pytest.mark.parametrize(
    "text",
    ["[]", "1", "null", '{"format": NaN}', pytest.param("[" * 100_000, id="deep"), "\xff"],
)
def test_refuses_what_is_no_trajectory(tmp_path: Path, text: str) -> None:
    path = tmp_path / "other.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=r"other\.json"):
        Plan.load(path)


def test_refuses_a_missing_file_and_a_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        Plan.load(tmp_path / "none.json")
    with pytest.raises(InputError, match="cannot be read"):
        Plan.load(tmp_path)


def test_writes_whole_or_not_at_all(plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "feed.json"
    target.write_text("old")

    def broken(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", broken)
    with pytest.raises(InputError, match="No space left"):
        plan.save(target, force=True)
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


ALTERATIONS: list[Callable[[Any], None]] = [
    lambda plan: plan["trajectory"]["joints"][0]["angle_points_deg"].__setitem__(3, 0.123),
    lambda plan: plan["arm"]["joints"][0]["limits"].update(speed_deg_s=51.0),
    lambda plan: plan["arm"]["joints"][1]["motor"].update(gear_ratio=21.0),
    lambda plan: plan["job"].update(seed=2),
    lambda plan: plan.update(notes=["nothing to see"]),
]


@pytest.mark.parametrize("alter", ALTERATIONS)
def test_an_altered_file_is_refused_unless_it_is_asked_for(
    path: Path, alter: Callable[[Any], None], caplog: pytest.LogCaptureFixture
) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    alter(content["plan"])
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match=r"feed\.json was altered .* --altered"):
        Plan.load(path)
    assert not caplog.records
    Plan.load(path, altered=True)
    assert "was altered" in caplog.text


def test_blanks_and_line_breaks_are_no_alteration(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path.write_text(json.dumps(json.loads(path.read_text())), encoding="utf-8")
    Plan.load(path)
    assert not caplog.records


def test_a_checksum_that_was_taken_away_is_missed(path: Path) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    del content["sha256"]
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match="missing key"):
        Plan.load(path)


def test_a_file_from_before_the_checksum_is_read_with_a_note(
    path: Path, plan: Plan, caplog: pytest.LogCaptureFixture
) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    del content["sha256"]
    path.write_text(json.dumps({**content, "version": 1}), encoding="utf-8")
    assert Plan.load(path).job == plan.job
    assert "before trajectory files had a checksum" in caplog.text


def test_an_altered_file_in_a_run_folder_is_to_be_brought_back(path: Path) -> None:
    (path.parent / "run.json").write_text("{}")
    content = json.loads(path.read_text(encoding="utf-8"))
    content["plan"]["job"]["seed"] = 7
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError, match="bring the original back"):
        Plan.load(path)


def test_only_an_earlier_plan_of_the_same_job_and_arm_is_replaced(plan: Plan, path: Path) -> None:
    changed(plan, job=replace(plan.job, seed=9)).save(path)
    assert Plan.load(path).job.seed == 9
    for other in (
        changed(plan, job=replace(plan.job, name="another")),
        replace(plan, arm=replace(plan.arm, name="another")),
    ):
        with pytest.raises(InputError, match=r"exists with other content.*the same job.*--force"):
            other.save(path)
        assert Plan.load(path).job.seed == 9
        other.save(path.with_name("new.json"), force=True)
        other.save(path, force=True)
        changed(plan, job=replace(plan.job, seed=9)).save(path, force=True)


def test_an_altered_plan_of_the_same_job_is_kept(plan: Plan, path: Path) -> None:
    content = json.loads(path.read_text(encoding="utf-8"))
    content["plan"]["job"]["seed"] = 7
    path.write_text(json.dumps(content), encoding="utf-8")
    before = path.read_bytes()
    with pytest.raises(InputError, match="--force"):
        plan.save(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize("text", ["", "name = 'arm'", "[1]", '{"format": "armtempo trajectory"}', "\xff"])
def test_what_is_no_trajectory_file_is_kept(plan: Plan, tmp_path: Path, text: str) -> None:
    target = tmp_path / "arm.toml"
    target.write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match="--force"):
        plan.save(target)
    assert target.read_bytes() == text.encode("latin-1")
