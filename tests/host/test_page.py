"""Pages and figures: numbers aligned, labels in the page's colour; the bar of a run under way."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.cli.results import ProgressBar
from armtempo.cli.run import RunProgress
from armtempo.cli.sequences import StateLine
from armtempo.encoding import encoded_plan
from armtempo.kinematics import chain
from armtempo.link.board_messages import Positions, Sample, SequenceState
from armtempo.paper import searches
from armtempo.report import analysis, arm_picture, drawing, html_page, plots, run_folder, sections
from armtempo.report.run_folder import RunFolder

from tests.host.made_runs import shipped_plan


def test_a_column_is_aligned_as_a_whole() -> None:
    sheet = html_page.Page("t")
    sheet.table(("n", "what"), [("1.5", "5, per-joint"), ("–", ("word", html_page.BAD))])
    cells = re.findall(r"<t[dh](?: [^>]*)?>[^<]*", sheet.render())
    assert cells == [
        '<th class="number">n',
        "<th>what",
        '<td class="number" data-column="n">1.5',
        '<td data-column="what">5, per-joint',
        '<td class="number" data-column="n">–',
        '<td class="bad" data-column="what">word',
    ]


@pytest.mark.slow
@pytest.mark.parametrize("turn_deg", [0.0, 37.0, 90.0, 160.0, 250.0])
def test_labels_of_the_arms_figure_are_inside_of_it(turn_deg: float) -> None:
    plan = shipped_plan()
    times = np.linspace(0.0, plan.trajectory.duration_s, 50)
    turn = np.radians(turn_deg)
    about_z = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    chains = chain.chains_mm(plan.arm, plan.via_deg) @ about_z
    drawn = arm_picture.postures(chains, chain.tool_path_mm(plan.arm, plan.trajectory, times) @ about_z)
    drawn.draw_without_rendering()
    (axis,) = drawn.axes
    for part in (axis.xaxis, axis.yaxis, axis.zaxis):
        box = part.label.get_window_extent()
        assert drawn.bbox.x0 <= box.x0 < box.x1 <= drawn.bbox.x1, part.label.get_text()
        assert drawn.bbox.y0 <= box.y0 < box.y1 <= drawn.bbox.y1, part.label.get_text()


def test_text_is_escaped() -> None:
    sheet = html_page.Page("a < b", "x & y")
    sheet.note("<script>")
    sheet.table(("<i>",), [("<b>",)], "<c>")
    assert not re.search(r"<(script|i|b|c)>", sheet.render())


def curves() -> analysis.Curves:
    """Runs of the shipped plan whose mean is the plan, with a standard error of a tenth of it."""
    plan = shipped_plan()
    times = np.linspace(0.0, plan.trajectory.duration_s, 50)
    mean = np.stack([plan.trajectory(times, order) for order in range(3)])
    return analysis.Curves(times, mean[None], mean, 0.1 * np.abs(mean), mean, mean, times, np.ones(3, bool))


def figure(name: str) -> str:
    """One of the figures as a page has it."""
    plan = shipped_plan()
    names = [joint.name for joint in plan.arm.driven]
    limits = [joint.limits for joint in plan.arm.driven if joint.limits]
    seen = curves()
    times, theory = seen.times_s, seen.mean
    runs = [(("acs", 10, seed), np.full(6, 6.0 + seed)) for seed in (1, 2)]
    chains = chain.chains_mm(plan.arm, plan.via_deg)
    drawn = {
        "motion": lambda: plots.motion(plan.trajectory, limits, names),
        "tracking": lambda: plots.tracking(seen, plan.trajectory, limits, names),
        "errors": lambda: plots.errors(seen, names),
        "overlay": lambda: plots.overlay({"one": (times, theory[:, :, 0], times)}),
        "convergence": lambda: plots.convergence({"one": np.arange(9.0)}),
        "postures": lambda: arm_picture.postures(
            chains, chain.tool_path_mm(plan.arm, plan.trajectory, times)
        ),
        "searches": lambda: searches.figure(searches.rows(runs)),
    }
    return drawing.inline_svg(drawn[name](), name, "what it shows")


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["motion", "tracking", "errors", "overlay", "convergence", "postures", "searches"]
)
def test_every_label_takes_the_colour_of_the_page(name: str) -> None:
    """Black text, matplotlib's default, would be lost on a dark page."""
    svg = figure(name)
    labels = re.findall(r'<text[^>]*style="([^"]*)"', svg)
    assert labels
    assert len(labels) == svg.count("<text")
    assert [label for label in labels if "fill: currentColor" not in label] == []
    assert re.search(r'aria-label="(joint \d: |x: )?what it shows"', svg)


@pytest.mark.slow
def test_the_band_around_a_mean_is_its_standard_error() -> None:
    plan, seen = shipped_plan(), curves()
    drawn = plots.tracking(seen, plan.trajectory, [], [joint.name for joint in plan.arm.driven])
    (band,) = drawn.axes[0].collections
    corners = band.get_paths()[0].vertices
    assert np.ptp(corners[:, 0]) == pytest.approx(seen.times_s[-1])
    mean, error = seen.mean[0, :, 0], seen.sem[0, :, 0]
    assert corners[:, 1].min() == pytest.approx(np.min(mean - error))
    assert corners[:, 1].max() == pytest.approx(np.max(mean + error))


@pytest.mark.slow
def test_figures_are_no_larger_than_they_must_be() -> None:
    """Coordinates finer than a hundredth of a point would only fill the page."""
    paths = re.findall(r' d="([^"]*)"', figure("searches"))
    assert paths
    assert not any(re.search(r"\.\d{3}", path) for path in paths)


def test_per_joint_timing_has_a_section() -> None:
    sheet = html_page.Page("feed")
    sections.plan_timing(sheet, shipped_plan())
    assert "<h2>Per-joint timing</h2>" in sheet.render()


# what a run under way shows: the bar's text


FOLDER = RunFolder(Path("runs/feed-001"), "feed", ())


def sample(time_s: float, off_deg: float) -> Sample:
    """All joints on the plan but for ``off_deg``."""
    plan = shipped_plan()
    scales = run_folder.scales(plan.arm)
    angles = plan.trajectory(time_s)
    steps = tuple(round(a * s.steps_per_deg) for a, s in zip(angles, scales, strict=True))
    counts = tuple(round((a + off_deg) * s.counts_per_deg) for a, s in zip(angles, scales, strict=True))
    return Sample(
        1, round(time_s * 10), round(time_s * 84e6), round(time_s * 84e6), 0, Positions(steps, counts)
    )


def test_angles_and_errors_stand_beside_the_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    notes: list[Any] = []
    with RunProgress() as live:
        live.begin(encoded_plan.of_plan(shipped_plan()), FOLDER)
        monkeypatch.setattr(live, "_progress", lambda *shown: notes.append(shown))
        live.on_sample(sample(3.0, 0.9), 6.8)
        monkeypatch.undo()
    time_s, whole_s, note = notes[0]
    assert (time_s, whole_s) == (3.0, 6.8)
    assert note.count("(+0.") == 3
    assert all(abs(float(part.split(")")[0]) - 0.9) < 0.1 for part in note.split("(")[1:])


@pytest.mark.slow
def test_the_command_line_loads_no_plotting_by_itself() -> None:
    code = (
        "import sys, armtempo.cli.run; assert 'matplotlib' not in sys.modules and 'scipy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("columns", [60, 80, 200])
def test_the_bar_never_wraps(
    columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setattr(ProgressBar, "_wanted", lambda self: True)
    monkeypatch.setattr("click._termui_impl.isatty", lambda stream: True)
    with ProgressBar("moving") as progress:
        for done in range(9):
            progress(done, 9, "12 s  " + "-123.4° (+0.12)  " * 6)
    lines = capsys.readouterr().err.replace("\x1b[?25l", "").replace("\x1b[?25h", "").split("\r")
    assert len(lines) > 5
    assert any("[" in line for line in lines)
    assert max(len(line.rstrip("\n")) for line in lines) <= columns


def test_the_state_of_a_sequence_or_program_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    printed: list[str] = []
    line = StateLine(lambda state: f"step {state.step}", printed.append)
    for step, cycle in ((0, 0), (2, 0), (1, 1), (3, 1), (3, 2)):
        line(SequenceState("running", 0, step, 0, cycle, "pick"))
    assert printed == ["1 whole cycle finished", "2 whole cycles finished"]  # without a terminal
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    line(SequenceState("running", 0, 4, 0, 2, "pick"))
    line.clear()
    assert capsys.readouterr().err == "\r\x1b[Kstep 4\r\x1b[K"
    assert len(printed) == 2
