"""What a run under way shows: the bar's text, and the window if there is a display."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.cli.live import Live
from armtempo.cli.progress import ProgressBar
from armtempo.link.board_messages import Positions, Sample
from armtempo.records import encoded_motion
from armtempo.report import run_folder
from armtempo.report.live_plot import LivePlot
from armtempo.report.run_folder import RunFolder

from tests.host.made_runs import shipped_plan

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
    with Live(window=False) as live:
        live.begin(encoded_motion.of_plan(shipped_plan()), FOLDER)
        monkeypatch.setattr(live, "_progress", lambda *shown: notes.append(shown))
        live.on_sample(sample(3.0, 0.9), 6.8)
        monkeypatch.undo()
    time_s, whole_s, note = notes[0]
    assert (time_s, whole_s) == (3.0, 6.8)
    assert note.count("(+0.") == 3
    assert all(abs(float(part.split(")")[0]) - 0.9) < 0.1 for part in note.split("(")[1:])


@pytest.mark.slow
def test_without_a_display_the_run_goes_on(capsys: pytest.CaptureFixture[str]) -> None:
    import matplotlib as mpl

    mpl.use("agg")
    with Live(window=True) as live:
        live.begin(encoded_motion.of_plan(shipped_plan()), FOLDER)
        live.on_sample(sample(1.0, 0.0), 6.8)
    assert "no live plot: there is no display" in capsys.readouterr().err


@pytest.mark.slow
def test_the_window_follows_the_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    import matplotlib.pyplot as plt

    monkeypatch.setattr(plt, "get_backend", lambda: "tkagg")
    monkeypatch.setattr("matplotlib.figure.Figure.show", lambda self: None)
    plan = shipped_plan()
    plot = LivePlot(plan.trajectory, ["a", "b", "c"])
    for time in (0.0, 0.1, 0.2):
        plot.add(time, plan.trajectory(time))
    assert [len(line.get_xdata()) for line in plot._lines] == [3, 3, 3]
    np.testing.assert_allclose(plot._lines[1].get_ydata()[-1], plan.trajectory(0.2)[1])
    plot.add(0.0, plan.trajectory(0.0))
    assert len(plot._lines[0].get_xdata()) == 1
    plot.close()
    assert not plt.get_fignums()


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
