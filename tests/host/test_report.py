"""The report of a run: complete, self-contained, and right in a real browser."""

from __future__ import annotations

import html
import json
import re
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.errors import RunFolderError
from armtempo.cli import main
from armtempo.model.parts import Driver, Joint, Limits
from armtempo.model.plan import Plan
from armtempo.planning import path_deviation
from armtempo.report import comparison, drawing, plots, run_report, verdict
from armtempo.report.evaluation import evaluate
from armtempo.report.run_folder import leg_file
from click.testing import CliRunner

from tests import browser
from tests.host import made_runs
from tests.plans import changed

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("report")]

FIGURES = ("tracking", "errors", "convergence", "postures")
LEG = leg_file(1)
PARTS = 8
"""The first two have a part for each joint."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of three repetitions with two samples lost, and its report."""
    path = made_runs.make(tmp_path_factory.mktemp("runs") / "feed-001", drop=(5, 6))
    run_report.write(path)
    return path


@pytest.fixture
def without_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are not drawn."""
    made_runs.draw_nothing(monkeypatch)


def test_the_page_and_every_figure_are_written(folder: Path) -> None:
    text = (folder / run_report.PAGE).read_text()
    assert text.count("<figure") == len(FIGURES)
    for name in FIGURES:
        assert (folder / f"{name}.svg").read_text().lstrip().startswith("<?xml")


def test_figures_of_several_threads_are_drawn_one_at_a_time() -> None:
    """They have the settings of Matplotlib in common."""
    drawn: list[bool] = []

    class Drawing:
        def get_layout_engine(self) -> None:
            return None

        def savefig(self, *_: object, **__: object) -> None:
            drawn.append(True)
            time.sleep(0.05)
            drawn.append(False)

    with ThreadPoolExecutor(2) as threads:
        list(threads.map(drawing._svg, (Drawing(), Drawing())))
    assert drawn == [True, False] * 2


def test_labels_of_tiny_errors_stay_within_their_figure(folder: Path) -> None:
    (found,) = evaluate(folder).legs
    curves = found.curves
    off = 1e-4 * np.sin(np.arange(curves.mean.shape[1]))[:, None]
    figure = plots.errors(
        replace(curves, mean=curves.theory + off, each=curves.theory + off + 0 * curves.each), found.names
    )
    figure.canvas.draw()
    left = min(axis.yaxis.get_tightbbox().x0 for axis in figure.axes)
    assert left >= 0.0


def test_the_search_shows_where_the_gradient_solver_ended() -> None:
    figure = plots.convergence({"joint 1": np.array([3.6, 3.5, 3.4])}, {"joint 1": 3.09})
    (_, end) = figure.axes[0].lines
    assert (end.get_xdata()[0], end.get_ydata()[0]) == (3, 3.09)


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
    found = evaluate(path)
    assert any("samples-02.csv" in text and "missing" in text for text in found.complaints)
    assert len(found.legs[0].curves.each) == 2


def test_a_reset_in_the_middle_is_said(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run")
    lines = (path / "samples-01.csv").read_text().splitlines()
    (path / "samples-01.csv").write_text("\n".join(lines[:20] + lines[1:5]) + "\n")
    assert any("starts again" in text for text in evaluate(path).complaints)


def describe(path: Path, **changes: object) -> None:
    """Change run.json; None takes a key away."""
    meta = json.loads((path / "run.json").read_text()) | changes
    kept = {key: value for key, value in meta.items() if value is not None}
    (path / "run.json").write_text(json.dumps(kept))


@pytest.mark.parametrize(
    ("cell", "value"),
    [
        (0, "9" * 20),
        (0, "x"),
        (2, "1e12"),
        (2, "nan"),
        (3, "1e30"),
        (3, "nan"),
        (4, "1e30"),
        (5, "inf"),
        (7, ""),
    ],
)
def test_a_cell_beyond_reason_makes_the_file_damaged(tmp_path: Path, cell: int, value: str) -> None:
    path = made_runs.make(tmp_path / "run", repetitions=2) / "samples-01.csv"
    lines = [line.split(",") for line in path.read_text().splitlines()]
    lines[5][cell] = value
    path.write_text("\n".join(map(",".join, lines)) + "\n")
    found = evaluate(path.parent)
    assert found.complaints[0].startswith("samples-01.csv: damaged (")
    assert len(found.legs[0].curves.each) == 1


def words(page: Path) -> str:
    """The text of a page without its drawings."""
    text = re.sub("<style.*?</style>|<svg.*?</svg>", "", page.read_text(), flags=re.DOTALL)
    return html.unescape(re.sub("<[^>]*>", " ", text))


def row(page: Path, *starts: str) -> list[str]:
    """The cells of the table row that begins with these."""
    text = page.read_text()
    rows = [re.findall("<td[^>]*>([^<]*)</td>", one) for one in re.findall("<tr>(<td.*?)</tr>", text)]
    (found,) = [cells for cells in rows if cells[: len(starts)] == [*starts]]
    return found


def legends(path: Path) -> list[str]:
    """What each joint's curves are called."""
    (found,) = evaluate(path).legs
    drawn = plots.tracking(found.curves, found.trajectory, found.limits, found.names)
    return [axis.get_legend().get_texts()[0].get_text() for axis in drawn.axes[: len(found.names)]]


def test_a_joint_without_an_encoder_is_shown_as_commanded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = made_runs.make(tmp_path / "run", plan=made_runs.blind_plan(1))
    assert legends(path) == ["measured", "commanded", "measured"]
    made_runs.draw_nothing(monkeypatch)
    page = run_report.write(path)
    text = words(page)
    assert "OK in what was measured" in text
    assert "joint 2 has no encoder, so whether the arm made the steps is not known" in text
    assert "an encoder would show lost steps" in text
    assert text.count("not measured") == 2
    assert row(page, "joint 2", "speed") == ["joint 2", "speed", "39.47", "40 °/s", "–", "not measured"]
    assert row(page, "joint 2", "1955")[2] == "1955"
    assert "nan" not in text


@pytest.mark.usefixtures("without_drawing")
def test_an_arm_without_encoders_gets_a_report_of_what_is_known(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run", plan=made_runs.blind_plan(0, 1, 2))
    page = run_report.write(path)
    text = words(page)
    assert "joint 1, joint 2 and joint 3 have no encoder" in text
    assert "Measured against the plan" not in text  # no table of dashes
    assert "not measured" not in text
    assert row(page, "joint 2", "speed") == ["joint 2", "speed", "39.47", "40 °/s"]
    assert [row(page, f"joint {n}", str(steps))[2] for n, steps in ((1, 6400), (2, 1955), (3, -3271))] == [
        "6400",
        "1955",
        "-3271",
    ]
    assert "the board made every step pulse of the motion" in text
    assert "the commanded motion keeps the limits of speed and acceleration" in text
    whole = evaluate(path)
    (found,) = whole.legs
    np.testing.assert_allclose(found.curves.mean[0], found.curves.theory[0], atol=0.015)  # half a step
    slower = [Limits(20.0, *limit.values[1:]) for limit in found.limits]
    arm = replace(found.arm, joints=tuple(limited(found.arm.joints, slower)))
    beyond = verdict.of(replace(whole, legs=(replace(found, arm=arm),))).line
    assert beyond.startswith(
        "Not OK: the commanded motion exceeds the speed or acceleration limit of joint 1, "
    )
    assert verdict.of(whole).summary == "OK in what was measured"


def limited(joints: Sequence[Joint], limits: Sequence[Limits]) -> Iterator[Joint]:
    """The joints with other limits if they are driven."""
    left = iter(limits)
    for joint in joints:
        yield replace(joint, limits=next(left)) if joint.motor else joint


@pytest.mark.usefixtures("without_drawing")
@pytest.mark.parametrize("blind", [(), (0, 1, 2)])
def test_a_motion_that_only_the_board_had_is_reported(tmp_path: Path, blind: tuple[int, ...]) -> None:
    plan = made_runs.blind_plan(*blind)
    path = made_runs.make(tmp_path / "run", plan=plan, on_board=True)
    result = CliRunner().invoke(main, ["report", str(path)])
    assert result.exit_code == 0, result.output
    page = path / run_report.PAGE
    text = words(page)
    assert "it was on the board, and is read back from its record" in text
    assert "armtempo run feed --repeat 3" in text
    assert page.read_text().count("<figure") == len(FIGURES) - 1  # all but the search
    found, whole = evaluate(path).legs[0], plan.trajectory
    times = np.linspace(0.0, whole.duration_s, 99)
    np.testing.assert_allclose(found.trajectory(times), whole(times), atol=1e-6)
    assert found.limits == [joint.limits for joint in plan.arm.driven]


@pytest.mark.usefixtures("without_drawing")
def test_of_a_folder_without_an_arm_the_limits_are_not_known(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run", on_board=True)
    (path / "arm.json").write_text("{")
    found = evaluate(path)
    assert found.legs[0].arm is None
    assert "arm.json: cannot be read" in found.complaints[0]
    (path / "arm.json").unlink()
    text = words(run_report.write(path))
    assert "does not say which arm it was, so the motion is not checked against limits" in text
    assert evaluate(path).complaints == ()


@pytest.mark.usefixtures("without_drawing")
def test_the_verdict_of_a_good_run_is_ok(folder: Path, tmp_path: Path) -> None:
    whole = made_runs.make(tmp_path / "whole")
    told = verdict.of(evaluate(whole))
    assert (told.state, told.summary, told.line) == ("good", "OK", "OK")
    text = words(run_report.write(whole))
    assert text.index("OK") < text.index("Result")
    lossy = verdict.of(evaluate(folder))
    assert lossy.line == "OK in what was measured: samples-01.csv: samples 5 to 6 are missing"


def entry(path: Path, number: int, **changes: object) -> None:
    """Change what run.json says of a repetition."""
    entries = json.loads((path / "run.json").read_text())["repetitions"]
    entries[number] |= changes
    describe(path, repetitions=entries)


def test_the_verdict_names_what_is_wrong(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run")
    entry(path, 1, commanded_steps=[6400, -1353, -1849], state="complete")
    told = verdict.of(evaluate(path))
    assert told.summary == "Not OK"
    assert "joint 2 ended up to 1 steps" not in told.line
    entry(path, 1, commanded_steps=[6398, -3378, -1849])
    assert "joint 1 ended up to 2 steps from where the motion ends" in verdict.of(evaluate(path)).line
    entry(path, 1, state="fault", fault="following")
    assert verdict.of(evaluate(path)).line == "Not OK: 2 of 3 repetitions complete"


def test_an_arm_that_does_not_follow_is_not_ok(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run", scatter_deg=3.0)
    line = verdict.of(evaluate(path)).line
    assert line.startswith("Not OK: ")
    assert re.search(r"joint 1 was up to \d+\.\d\d° from the plan, 2° are allowed", line)


def test_every_column_is_explained(folder: Path) -> None:
    text = (folder / run_report.PAGE).read_text()
    explained = set(re.findall("<dt>([^<]*)</dt>", text))
    for name in (
        "angle RMS (°)",
        "final (°)",
        "lag at end (ms)",
        "steps made",
        "planned",
        "verdict",
        "at least (s)",
    ):
        assert name in explained


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda path: (path / "run.json").unlink(), "not a run folder"),
        (lambda path: (path / "run.json").write_text("{"), "damaged"),
        (
            lambda path: [(path / name).unlink() for name in ("trajectory.json", LEG)],
            "the planned motion is not",
        ),
        (lambda path: [(path / "trajectory.json").unlink(), (path / LEG).write_bytes(b"x")], LEG),
        (lambda path: describe(path, name=None), "'name' is missing"),
        (lambda path: describe(path, started=None), "'started' is missing"),
        (lambda path: describe(path, joints=[]), "run.json lists 0 joints, 'feed' has 3"),
        (lambda path: describe(path, joints=[{"name": "a"}]), "'steps_per_deg' is missing"),
        (lambda path: [file.write_text("") for file in path.glob("samples-*")], "no sample"),
    ],
)
def test_a_folder_that_is_no_run_is_refused(tmp_path: Path, spoil: object, said: str) -> None:
    path = made_runs.make(tmp_path / "run", repetitions=1)
    spoil(path)  # type: ignore[operator]
    with pytest.raises(RunFolderError, match=said):
        evaluate(path)
    result = CliRunner().invoke(main, ["report", str(path)])
    assert result.exit_code == 1
    assert said in result.output
    assert "Traceback" not in result.output


def test_two_runs_are_compared_on_one_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [str(made_runs.make(tmp_path / f"run-{seed}", repetitions=1, seed=seed)) for seed in (1, 2)]
    made_runs.draw_nothing(monkeypatch)
    broken = tmp_path / "broken"
    broken.mkdir()
    result = CliRunner().invoke(main, ["report", *runs])
    assert result.exit_code == 0, result.output
    page = (tmp_path / comparison.PAGE).read_text()
    assert "run-1" in page
    assert page.count("<figure") == 3
    three = CliRunner().invoke(main, ["report", *runs, str(broken), "--out", str(tmp_path / "three.html")])
    assert three.exit_code == 0, three.output
    assert "broken is not a run folder" in three.stderr
    assert "broken is not a run folder" in (tmp_path / "three.html").read_text()
    alone = CliRunner().invoke(main, ["report", runs[0], "--out", str(tmp_path / "none.html")])
    assert (alone.exit_code, "two or more" in alone.output) == (2, True)
    with pytest.raises(RunFolderError, match="needs two readable runs"):
        comparison.write([Path(runs[0]), broken], tmp_path / "none.html")
    assert not (tmp_path / "none.html").exists()


@pytest.mark.usefixtures("without_drawing")
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
    assert text.count("<figure") == len(FIGURES)


def test_when_the_joints_pass_the_via_points_is_told(folder: Path) -> None:
    plan = made_runs.shipped_plan()
    text = (folder / run_report.PAGE).read_text()
    times = [joint.via_times_s[2] for joint in plan.trajectory.joints]
    cells = ("P2", *(f"{time:.3f}" for time in times), f"{max(times) - min(times):.3f}")
    row = re.search(r"<tr><td[^>]*>P2.*?</tr>", text)
    assert row
    assert tuple(re.findall(r">([^<]+)<", row.group())) == cells
    assert f"strays up to {path_deviation.tool_stray_mm(plan.arm, plan.trajectory):.1f} mm" in text


@pytest.mark.usefixtures("without_drawing")
def test_shared_timing_needs_no_such_section(tmp_path: Path) -> None:
    path = made_runs.make(tmp_path / "run", repetitions=1)
    spoil_plan(
        path, lambda plan: changed(plan, job=replace(plan.job, timing="shared"), notes=("by way of X",))
    )
    run_report.write(path)
    text = (path / run_report.PAGE).read_text()
    assert "Per-joint timing" not in text
    assert "Note: by way of X" in text


def spoil_plan(path: Path, change: Callable[[Plan], Plan]) -> None:
    """Change the plan in a run folder."""
    file = path / "trajectory.json"
    change(Plan.load(file)).save(file, force=True)


@pytest.mark.usefixtures("without_drawing")
@pytest.mark.parametrize("changes", [{"name": "another"}, {"driver": Driver(pulse_us=9.0)}])
def test_runs_of_different_arms_are_told_apart(tmp_path: Path, changes: dict[str, Any]) -> None:
    runs = [made_runs.make(tmp_path / name, repetitions=1) for name in ("one", "two")]
    comparison.write(runs, tmp_path / "page.html")
    assert "different arms" not in (tmp_path / "page.html").read_text()
    spoil_plan(runs[1], lambda plan: replace(plan, arm=replace(plan.arm, **changes)))
    comparison.write(runs, tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text()
    assert "different arms" in text
    assert text.count("<figure") == 3


@pytest.mark.parametrize(("dark", "widths"), [(False, (1200, 768)), (True, (1200, 375))])
def test_in_a_browser(folder: Path, tmp_path: Path, dark: bool, widths: tuple[int, ...]) -> None:
    """Wide and narrow, light and dark: nothing fetched, nothing cut off or to be scrolled sideways, all to be read."""
    browser.needed()
    for width, found in zip(
        widths, browser.probe(folder / run_report.PAGE, tmp_path, widths, dark), strict=True
    ):
        assert found["width"] == width
        assert found["fetched"] == []
        assert found["overflow"] <= 0
        assert found["cut"] == []
        assert len(found["figures"]) == PARTS
        assert min(found["figures"]) > 80
        # Of CSS pixels to points: text of 10 points is 9 pixels high or more
        assert min(found["scales"]) > 0.9
        assert found["tables"] == 6
        assert "How to repeat it" in found["text"]
        assert "Per-joint timing" in found["text"]
        assert (found["background"] == "rgb(255, 255, 255)") != dark
        assert found["colour"] != found["background"]
