"""The experiment of section 4 and the page of ``armtempo paper``, from made-up runs."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import LinkError
from armtempo.model.parts import Limits
from armtempo.paper import experiment, motions, searches, sheet
from armtempo.paper.experiment import CUBIC, QUINTIC, UNOPTIMISED, Series
from armtempo.paper.printed import DIFFERS, SAME
from armtempo.report import drawing
from armtempo.report.evaluation import evaluate
from armtempo.robot.stop_request import StopRequest

from tests.host import made_runs

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("paper")]  # what they share is made once


@pytest.fixture(scope="module")
def made() -> motions.Plans:
    """The shipped job, both plans the same: what is drawn of them does not matter here."""
    plan = made_runs.shipped_plan()
    return motions.Plans(plan.arm, plan.job, plan, plan)


def series(folder: Path, scatter_deg: dict[str, float]) -> list[Series]:
    """Three runs of the quintic motion with more or less noise."""
    return [
        Series(name, evaluate(made_runs.make(folder / name, 2, scatter)))
        for name, scatter in scatter_deg.items()
    ]


def searched() -> list[searches.Row]:
    """Two searches of two seeds."""
    return searches.rows((("acs", n, seed), np.full(6, 6.0)) for n in (10, 50) for seed in (1, 2))


@pytest.mark.parametrize(("quintic", "cubic", "verdict"), [(0.02, 0.2, SAME), (0.2, 0.02, DIFFERS)])
def test_fig_12_is_judged_by_how_rough_the_ends_are(
    quintic: float, cubic: float, verdict: str, tmp_path: Path
) -> None:
    found = experiment.claims(series(tmp_path, {QUINTIC: quintic, CUBIC: cubic, UNOPTIMISED: 0.02}))
    ends = [claim for claim in found if claim.where == "Fig. 12"]
    assert [claim.verdict for claim in ends] == [verdict, verdict]
    assert all("times" in claim.found for claim in ends)


def test_a_limit_that_is_exceeded_shows(tmp_path: Path) -> None:
    runs = series(tmp_path, {QUINTIC: 0.02, CUBIC: 0.02, UNOPTIMISED: 0.02})
    found = runs[0].found
    assert found.arm is not None
    lower = [
        replace(joint, limits=joint.limits and Limits(*(value / 10 for value in joint.limits.values)))
        for joint in found.arm.joints
    ]
    runs[0] = replace(runs[0], found=replace(found, arm=replace(found.arm, joints=tuple(lower))))
    kept = [claim for claim in experiment.claims(runs) if "keeps its limit" in claim.what]
    assert len(kept) == 6
    assert any(claim.verdict == DIFFERS and claim.because for claim in kept)


def test_the_page_is_whole(made: motions.Plans, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "inline_svg", lambda figure, name, description: f"<svg>{name}</svg>")
    runs = series(tmp_path, {QUINTIC: 0.02, CUBIC: 0.2, UNOPTIMISED: 0.02})
    claims = experiment.claims(runs)
    text = sheet.render(claims, made, searched(), runs)
    for claim in claims:
        assert claim.what in text
        assert claim.found in text
    for number in (4, 5, 6, 7, 10, 11, 12):
        assert f"<svg>fig{number}</svg>" in text
        assert f"Fig. {number}:" in text
    assert 'replays of each motion</td><td data-column="value">2<' in text


def test_a_replay_that_fails_ends_the_others(
    made: motions.Plans, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def replayed(plan: object, folder: Path, times: int, stop: StopRequest, tell: object) -> Path:
        if folder.name == CUBIC:
            raise LinkError("out")
        while not stop.wanted:
            time.sleep(0.01)
        return folder

    monkeypatch.setattr(experiment, "_replayed", replayed)
    with pytest.raises(LinkError, match="out"):
        experiment.run(made, tmp_path, True, None)


def test_an_interrupt_ends_all(made: motions.Plans, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def replayed(plan: object, folder: Path, times: int, stop: StopRequest, tell: object) -> Path:
        stop.wanted = True
        return folder

    monkeypatch.setattr(experiment, "_replayed", replayed)
    with pytest.raises(KeyboardInterrupt):
        experiment.run(made, tmp_path, True, None)


def test_the_three_motions_are_the_paper_s(
    made: motions.Plans, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = {}

    def replayed(plan: motions.Plan, folder: Path, times: int, stop: object, tell: object) -> Path:
        seen[folder.name] = (plan.trajectory.joints[0].degree, plan.trajectory.joints[0].duration_s, times)
        return made_runs.make(folder, 1)

    monkeypatch.setattr(experiment, "_replayed", replayed)
    cubic = motions.motion([float(via[0]) for via in made.job.via], [1.0] * 6, 3)  # type: ignore[index]
    plan = replace(made.cubic, trajectory=replace(made.cubic.trajectory, joints=(cubic,) * 3))
    experiment.run(replace(made, cubic=plan), tmp_path, False, None)
    assert seen[UNOPTIMISED] == (5, pytest.approx(12.0), 10)
    assert seen[CUBIC][0] == 3
    assert seen[QUINTIC] == (5, made.quintic.trajectory.joints[0].duration_s, 10)
