"""The report of a run: complete, self-contained, and right in a real browser."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from armtempo.cli import main
from armtempo.errors import RunFolderError
from armtempo.model import trajectory_file
from armtempo.model.arm import Driver
from armtempo.model.plan import Plan
from armtempo.planning import path_deviation
from armtempo.report import comparison, run_report
from click.testing import CliRunner

from tests import browser
from tests.host import made_runs

pytestmark = pytest.mark.slow

FIGURES = ("tracking", "errors", "motion", "convergence", "postures")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of three repetitions with two samples lost, and its report."""
    path = made_runs.make(tmp_path_factory.mktemp("runs") / "feed-001", drop=(5, 6))
    run_report.write(path)
    return path


def test_the_page_and_every_figure_are_written(folder: Path) -> None:
    text = (folder / run_report.PAGE).read_text()
    assert text.count("<svg") == len(FIGURES)
    for name in FIGURES:
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert (folder / f"{name}.svg").read_text().lstrip().startswith("<?xml")


def test_nothing_is_fetched_and_no_id_is_used_twice(folder: Path) -> None:
    text = (folder / run_report.PAGE).read_text()
    assert not re.search(r'(src|href)="(?!#)', text.replace('xlink:href="#', ""))
    assert "@import" not in text
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(ids) == len(set(ids))


def test_what_is_missing_is_said(folder: Path) -> None:
    assert "samples-01.csv: samples 5 to 6 are missing" in (folder / run_report.PAGE).read_text()


def test_a_repetition_that_is_missing_does_not_hide_the_others(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run")
    (path / "samples-02.csv").unlink()
    (path / "samples-03.csv").write_text((path / "samples-03.csv").read_text()[:900])
    found = run_report.evaluate(path)
    assert any("samples-02.csv" in text and "missing" in text for text in found.complaints)
    assert len(found.curves.each) == 2


def test_a_reset_in_the_middle_is_said(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run")
    lines = (path / "samples-01.csv").read_text().splitlines()
    (path / "samples-01.csv").write_text("\n".join(lines[:20] + lines[1:5]) + "\n")
    assert any("starts again" in text for text in run_report.evaluate(path).complaints)


def describe(path: Path, **changes: object) -> None:
    """Change run.json; None takes a key away."""
    meta = json.loads((path / "run.json").read_text()) | changes
    kept = {key: value for key, value in meta.items() if value is not None}
    (path / "run.json").write_text(json.dumps(kept))


@pytest.mark.parametrize(
    ("cell", "value"),
    [(0, "9" * 20), (0, "x"), (2, "1e12"), (2, "nan"), (3, "1e30"), (3, "nan"), (4, "inf"), (6, "")],
)
def test_a_cell_beyond_reason_makes_the_file_damaged(tmp_path: Path, cell: int, value: str) -> None:
    path = made_runs.make(tmp_path / "run", repetitions=2) / "samples-01.csv"
    lines = [line.split(",") for line in path.read_text().splitlines()]
    lines[5][cell] = value
    path.write_text("\n".join(map(",".join, lines)) + "\n")
    found = run_report.evaluate(path.parent)
    assert found.complaints[0].startswith("samples-01.csv: damaged (")
    assert len(found.curves.each) == 1


def test_a_joint_without_an_encoder_is_not_judged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = made_runs.shipped_plan()
    joints = list(whole.arm.joints)
    joints[1] = replace(joints[1], encoder=None)
    blind = replace(whole, arm=replace(whole.arm, joints=tuple(joints)))
    monkeypatch.setattr(made_runs, "shipped_plan", lambda: blind)
    page = run_report.write(made_runs.make(tmp_path / "run")).read_text()
    assert page.count("not measured") == 2
    assert "nan" not in re.sub("<svg.*?</svg>", "", page, flags=re.DOTALL)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda path: (path / "run.json").unlink(), "not a run folder"),
        (lambda path: (path / "run.json").write_text("{"), "damaged"),
        (lambda path: (path / "trajectory.json").unlink(), "no trajectory.json"),
        (lambda path: describe(path, name=None), "'name' is missing"),
        (lambda path: describe(path, started=None), "'started' is missing"),
        (lambda path: describe(path, joints=[]), "run.json tells of 0 joints, trajectory.json of 3"),
        (lambda path: describe(path, joints=[{"name": "a"}]), "is missing or wrong"),
        (lambda path: [file.write_text("") for file in path.glob("samples-*")], "no sample"),
    ],
)
def test_a_folder_that_is_no_run_is_refused(tmp_path: Path, spoil: object, said: str) -> None:
    path = made_runs.make(tmp_path / "run", repetitions=1)
    spoil(path)  # type: ignore[operator]
    with pytest.raises(RunFolderError, match=said):
        run_report.evaluate(path)
    result = CliRunner().invoke(main, ["report", str(path)])
    assert result.exit_code == 1
    assert said in result.output
    assert "Traceback" not in result.output


def test_two_runs_are_compared_on_one_page(tmp_path: Path) -> None:
    runs = [str(made_runs.make(tmp_path / f"run-{seed}", seed=seed)) for seed in (1, 2)]
    broken = tmp_path / "broken"
    broken.mkdir()
    result = CliRunner().invoke(main, ["report", *runs])
    assert result.exit_code == 0, result.output
    page = (tmp_path / comparison.PAGE).read_text()
    assert "run-1" in page
    assert page.count("<svg") == 3
    three = CliRunner().invoke(main, ["report", *runs, str(broken), "--out", str(tmp_path / "three.html")])
    assert three.exit_code == 0, three.output
    assert "broken is not a run folder" in three.stderr
    assert "broken is not a run folder" in (tmp_path / "three.html").read_text()
    alone = CliRunner().invoke(main, ["report", runs[0], "--out", str(tmp_path / "none.html")])
    assert (alone.exit_code, "two or more" in alone.output) == (2, True)
    with pytest.raises(RunFolderError, match="fewer than two"):
        comparison.write([Path(runs[0]), broken], tmp_path / "none.html")
    assert not (tmp_path / "none.html").exists()


def test_a_run_cut_short_is_said_and_the_rest_reported(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run", repetitions=2)
    meta = json.loads((path / "run.json").read_text())
    meta["repetitions"][1] |= {"state": "fault", "fault": "following"}
    (path / "run.json").write_text(json.dumps(meta))
    samples = path / "samples-02.csv"
    samples.write_text("".join(samples.read_text().splitlines(keepends=True)[:31]))
    run_report.write(path)
    text = (path / run_report.PAGE).read_text()
    assert "samples-02.csv: cut short, ended as fault (following) after 2.9 s" in text
    assert "1 of 2 repetitions complete" in text
    assert text.count("<svg") == len(FIGURES)


def test_when_the_joints_pass_the_via_points_is_told(folder: Path) -> None:
    plan = made_runs.shipped_plan()
    text = (folder / run_report.PAGE).read_text()
    times = [joint.via_times_s[2] for joint in plan.trajectory.joints]
    cells = ("P2", *(f"{time:.3f}" for time in times), f"{max(times) - min(times):.3f}")
    row = re.search(r"<tr><td>P2.*?</tr>", text)
    assert row
    assert tuple(re.findall(r">([^<]+)<", row.group())) == cells
    assert f"strays up to {path_deviation.tool_stray_mm(plan.arm, plan.trajectory):.1f} mm" in text


def test_shared_timing_needs_no_such_section(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run", repetitions=1)
    spoil_plan(
        path, lambda plan: replace(plan, job=replace(plan.job, timing="shared"), notes=("by way of X",))
    )
    run_report.write(path)
    text = (path / run_report.PAGE).read_text()
    assert "Per-joint timing" not in text
    assert "Note: by way of X" in text


def spoil_plan(path: Path, change: Callable[[Plan], Plan]) -> None:
    """Change the plan in a run folder."""
    file = path / "trajectory.json"
    trajectory_file.save(change(trajectory_file.load(file)), file)


@pytest.mark.parametrize("changes", [{"name": "another"}, {"driver": Driver(pulse_us=9.0)}])
def test_runs_of_different_arms_are_told_apart(tmp_path: Path, changes: dict[str, Any]) -> None:
    runs = [made_runs.make(tmp_path / name, repetitions=1) for name in ("one", "two")]
    comparison.write(runs, tmp_path / "page.html")
    assert "different arms" not in (tmp_path / "page.html").read_text()
    spoil_plan(runs[1], lambda plan: replace(plan, arm=replace(plan.arm, **changes)))
    comparison.write(runs, tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text()
    assert "different arms" in text
    assert text.count("<svg") == 3


def test_in_a_browser(folder: Path, tmp_path: Path) -> None:
    """Wide, on a phone, light and dark: nothing fetched, nothing cut off, all figures there."""
    browser.needed()
    page = folder / run_report.PAGE
    light = browser.probe(page, tmp_path, 1200)
    dark = browser.probe(page, tmp_path, 1200, dark=True)
    phone = browser.probe(page, tmp_path, 500)
    for found in (light, dark, phone):
        assert found["fetched"] == []
        assert found["overflow"] <= 0
        assert len(found["figures"]) == len(FIGURES)
        assert min(found["figures"]) > 80
        assert found["tables"] == 5
        assert "How to repeat it" in found["text"]
        assert "Per-joint timing" in found["text"]
    assert phone["width"] <= 500
    assert light["background"] == "rgb(255, 255, 255)"
    assert dark["background"] != light["background"]
    assert dark["colour"] != light["colour"]
