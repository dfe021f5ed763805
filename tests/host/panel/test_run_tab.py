"""Runs: of the plan, and past ones."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from armtempo.basics.errors import RunFolderError
from armtempo.basics.progress import Progress
from armtempo.panel import layout, past_runs, words
from armtempo.panel.panel_board import PanelBoard
from armtempo.report import run_report
from armtempo.report.comparison import PAGE as COMPARISON

from tests.host.panel.fakes import ARM, board_state
from tests.host.panel.pages import Page, pages


def test_runs_of_the_command_line_are_listed_the_newest_first(tmp_path: Path) -> None:
    for number, (name, state) in enumerate({"feed-001": "complete", "feed-002": "fault"}.items()):
        (tmp_path / name).mkdir()
        fault = "" if state == "complete" else "estop"
        made = {"file": "samples-01.csv", "duration_s": 6.8, "fault": fault, "state": state}
        meta: dict[str, Any] = {
            "format": "armtempo run",
            "version": 2,
            "started": "2026-01-02T03:04:05+00:00",
        }
        meta["repetitions"] = [made, made]
        (tmp_path / name / "run.json").write_text(json.dumps(meta))
        os.utime(tmp_path / name / "run.json", (1000 + number, 1000 + number))
    for name, text in (("damaged", "{"), ("other", "[1]"), ("empty", "{}")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.json").write_text(text)
        os.utime(tmp_path / name / "run.json", (1, 1))
    rows = past_runs.listed(tmp_path, 9)
    assert past_runs.listed(tmp_path, 2) == rows[:2]
    assert [(row.folder.name, row.duration, row.ending) for row in rows[:2]] == [
        ("feed-002", "13.6 s", "estop"),
        ("feed-001", "13.6 s", "complete"),
    ]
    assert {row.ending for row in rows[2:]} == {"cannot be read"}
    meta["repetitions"] = [{**made, "state": "running", "fault": ""}]
    (tmp_path / name / "run.json").write_text(json.dumps(meta))
    assert past_runs.listed(tmp_path, 1)[0].ending == "running"
    os.utime(tmp_path / name / "run.json", (time.time() - 100,) * 2)  # its program was killed
    assert past_runs.listed(tmp_path, 1)[0].ending == words.NO_END
    with pytest.raises(RunFolderError, match="damaged"):
        past_runs.report(tmp_path, "damaged")


@pytest.mark.parametrize("name", ["", ".", "..", "../runs/feed", "feed/../feed", "/", "feed\0", "other"])
def test_only_runs_of_the_list_have_a_report(tmp_path: Path, name: str) -> None:
    for folder in (tmp_path, tmp_path / "runs", tmp_path / "runs" / "feed"):
        folder.mkdir(exist_ok=True)
        (folder / "run.json").write_text("{}")
    for call in (past_runs.report, lambda runs, name: past_runs.comparison(runs, ["feed", name])):
        with pytest.raises(RunFolderError, match="there is no run"):
            call(tmp_path / "runs", name)


def test_a_report_is_made_once_and_again_when_the_run_was_written_since(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Path] = []
    meta = tmp_path / "feed" / "run.json"
    meta.parent.mkdir()
    meta.write_text("{}")

    def write(folder: Path) -> None:
        made.append(folder)
        time.sleep(0.05)  # the other thread asks for it meanwhile
        (folder / run_report.PAGE).write_text(f"report {len(made)}")
        if len(made) == 2:
            meta.write_text('{"ended": true}')  # by the program that runs it

    def asked() -> set[bytes]:
        with ThreadPoolExecutor(2) as threads:
            return set(threads.map(lambda _: past_runs.report(tmp_path, "feed"), range(2)))

    monkeypatch.setattr(run_report, "write", write)
    assert asked() == {b"report 1"}
    os.utime(meta.with_name(run_report.PAGE), (1, 1))  # the run was written since
    assert asked() == {b"report 2", b"report 3"}
    assert past_runs.report(tmp_path, "feed") == b"report 3"


def planned(operator: PanelBoard) -> None:
    """A plan of the job as it is, whose curves nobody looks at."""
    plan: Any = type(
        "Planned",
        (),
        {"job": type("Job", (), {"name": "feed"}), "total_s": 6.79, "arm": ARM, "trajectory": None},
    )()
    operator.live.state = board_state()
    operator.jobs.planned(plan, operator.jobs.version)


@pytest.fixture
def run_page(operator: PanelBoard, monkeypatch: pytest.MonkeyPatch) -> Iterator[Page]:
    """A page on the tab, which draws no path of the plan."""
    monkeypatch.setattr(layout, "tool_path_mm", lambda *given: np.zeros((len(given[-1]), 3)))
    planned(operator)
    with pages(operator) as page:
        page.show(words.TAB_RUN)
        page.look()
        yield page


def test_the_plan_is_named_with_its_duration_and_file(operator: PanelBoard, run_page: Page) -> None:
    assert f"feed: 6.790 s · {words.NOT_SAVED}" in run_page.texts()
    operator.jobs.set_angle(0, 0, "5")
    run_page.look()
    assert words.PLAN_IS_OLD in run_page.texts()
    assert not run_page.named(words.RUN).enabled


def test_what_is_left_of_a_run_counts_all_repetitions_at_the_boards_speed(
    operator: PanelBoard, run_page: Page
) -> None:
    """Nothing of a run is done when its upload is."""
    said: list[str] = []

    def upload(plan: object, replace: bool, progress: Progress) -> None:
        progress(9, 9)

    def run(plan: Any, times: int, runs: object, progress: Progress, stop: object) -> None:
        for done_s in (None, 0.25 * times * plan.total_s):
            if done_s is not None:
                progress(done_s, times * plan.total_s)
            run_page.of.refresh()
            said.extend(text for text in run_page.texts() if "left" in text)

    operator.board.upload, operator.board.run = upload, run  # type: ignore[method-assign, assignment]
    operator.live.state = board_state(speed_percent=50.0)
    run_page.named(words.REPEAT).set_value(2)
    run_page.press(words.RUN)
    run_page.done()
    assert said == ["feed: 0%, 27 s left", "feed: 25%, 20 s left"]


@pytest.mark.parametrize("number", [0, 100, 1.5, None])
def test_a_number_of_repetitions_that_is_not_possible_is_refused(
    operator: PanelBoard, run_page: Page, number: float | None
) -> None:
    run_page.named(words.REPEAT).set_value(number)
    run_page.press(words.RUN)
    run_page.done()
    wrong = f"Repetitions: {number or 0:g} are not possible; give 1 to 99"
    assert any(wrong in text for text in run_page.texts())
    assert operator.board.calls == []  # type: ignore[attr-defined]
    run_page.press(words.DISMISS)
    run_page.look()
    assert not any(wrong in text for text in run_page.texts())


def test_reports_and_comparisons_open_where_the_server_has_them(operator: PanelBoard) -> None:
    """By addresses, which the browser opens at the press: a page that a server opens later may be kept back."""
    for name in ("a", "b"):
        (operator.runs / name).mkdir(parents=True)
        (operator.runs / name / "run.json").write_text("{}")
    with pages(operator) as page:
        page.show(words.TAB_RUN)
        page.look()
        assert page.named(f"{words.REPORT}: a").props["href"] == f"/runs/a/{run_report.PAGE}"
        for name in ("b", "a"):
            page.named(f"{words.COMPARE}: {name}").set_value(True)
        assert page.named(words.COMPARE).props["href"] == f"/runs/{COMPARISON}?run=a&run=b"
        (operator.runs / "c").mkdir()
        (operator.runs / "c" / "run.json").write_text("{}")
        page.look()  # another program's run is added to the list
        assert page.named(f"{words.COMPARE}: b").value
        assert page.named(words.COMPARE).props["href"] == f"/runs/{COMPARISON}?run=a&run=b"
        assert page.named(words.COMPARE).enabled
        page.named(f"{words.COMPARE}: b").set_value(False)
        page.look()
        assert not page.named(words.COMPARE).enabled  # with the reason
