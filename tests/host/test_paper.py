"""The paper repeated: each table's claims, the experiment of section 4, the page; a wrong result would show."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo.basics.errors import LinkError
from armtempo.model.parts import Limits
from armtempo.paper import experiment, motions, postures, printed, searches, sheet
from armtempo.paper.experiment import CUBIC, QUINTIC, UNOPTIMISED, Series
from armtempo.paper.printed import BETTER, DIFFERS, SAME, compared
from armtempo.report import drawing
from armtempo.report.evaluation import evaluate
from armtempo.robot.stop_request import StopRequest

from tests.host import made_runs
from tests.plans import changed

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("paper")]  # what they share is made once


@pytest.fixture(scope="module")
def made() -> motions.Plans:
    """The shipped job, quintic and cubic."""
    return motions.plans()


def test_table_2_comes_out_but_for_its_misprint(made: motions.Plans) -> None:
    found = postures.claims(made.arm)
    assert [claim.verdict for claim in found] == [SAME] * 3 + [DIFFERS] + [SAME] * 4
    assert "θ6 must be 180" in found[3].because


def test_a_wrong_posture_would_be_noticed(made: motions.Plans, monkeypatch: pytest.MonkeyPatch) -> None:
    spoilt = [list(row) for row in printed.SOLUTIONS]
    spoilt[0][1] += 0.3
    monkeypatch.setattr(printed, "SOLUTIONS", tuple(map(tuple, spoilt)))
    claim = postures.claims(made.arm)[0]
    assert claim.verdict == DIFFERS
    assert "no solution within" in claim.because


def test_the_motions_claims(made: motions.Plans) -> None:
    by_what = {claim.what: claim for claim in motions.claims(made)}
    for what, claim in by_what.items():
        assert claim.verdict in (SAME, BETTER), (what, claim)
    assert by_what["joint 1 before optimisation, peak speed (°/s)"].found == "29.119"
    assert by_what["joint 2, motion time (s)"].verdict == BETTER


def test_a_plan_that_is_slower_differs_and_says_why(made: motions.Plans) -> None:
    slow = motions.motion([float(via[0]) for via in made.job.via], [2.0] * 6, 5)  # type: ignore[index]
    joints = (slow, *made.quintic.trajectory.joints[1:])
    trajectory = replace(made.quintic.trajectory, joints=joints)
    claims = motions.claims(replace(made, quintic=changed(made.quintic, trajectory=trajectory)))
    total = next(claim for claim in claims if claim.what == "joint 1, motion time (s)")
    assert (total.verdict, total.found) == (DIFFERS, "12.0000")
    assert total.because


@pytest.mark.parametrize(("best", "verdict"), [(6.034, SAME), (6.2, DIFFERS)])
def test_table_4_is_judged_by_the_median(best: float, verdict: str) -> None:
    runs = [(("acs", 10, seed), np.full(6, best + 0.001 * seed)) for seed in (-1, 0, 1)]
    (claim,) = searches.claims(searches.rows(runs))
    assert claim.verdict == verdict
    assert claim.printed == "6.034"


def test_numbers_are_compared_at_the_printed_precision() -> None:
    assert compared("", "", 0.069, 0.0695, 3).verdict == SAME
    assert compared("", "", 0.069, 0.0712, 3, "why").because == "why"


def test_the_printed_sums_are_those_of_the_printed_intervals() -> None:
    np.testing.assert_allclose([sum(row) for row in printed.INTERVALS_S], printed.TOTALS_S, atol=1e-9)
    assert 1 - sum(printed.TOTALS_S) / 36 == pytest.approx(printed.REDUCTION, abs=5e-4)


def test_searches_of_a_joint_come_in_the_order_of_table_4(
    made: motions.Plans, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(searches, "ITERATIONS", 3)
    search = searches._Search.of(made.arm, made.job)
    found = [search((name, population, 1)) for population in (6, 4) for name in ("acs", "pso", "ga")]
    rows = searches.rows(found)
    assert [(row.algorithm, row.population) for row in rows] == [
        (name, population) for name in ("ga", "pso", "acs") for population in (4, 6)
    ]
    assert all(row.curves.shape == (5, 4) and (np.diff(row.curves[2]) <= 0).all() for row in rows)


def test_searches_get_the_paper_s_problem(made: motions.Plans) -> None:
    fitness, _ = searches._Search.of(made.arm, made.job).problem()
    assert fitness.penalised(np.array([printed.INTERVALS_S[0]]))[0] == pytest.approx(6.033, abs=0.02)


@pytest.mark.long
def test_searches_on_all_cores(made: motions.Plans, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(searches, "QUICK_POPULATIONS", (4,))
    monkeypatch.setattr(searches, "QUICK_SEEDS", 1)
    told: list[tuple[int, int]] = []
    rows = searches.run(made.arm, made.job, True, lambda done, whole: told.append((done, whole)))
    assert [row.algorithm for row in rows] == list(printed.SEARCHES_S)
    assert told[-1] == (6, 6)
    search = searches._Search.of(made.arm, made.job)
    assert rows[-1].curves[2] == pytest.approx(search(("acs", 4, 1))[1])


# the experiment of section 4 and the page of ``armtempo paper``, from made-up runs


pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("paper")]  # what they share is drawn once


@pytest.fixture(scope="module")
def drawn() -> motions.Plans:
    """The shipped job, both plans the same: what is drawn of them does not matter here."""
    plan = made_runs.shipped_plan()
    return motions.Plans(plan.arm, plan.job, plan, plan)


def series(folder: Path, scatter_deg: dict[str, float]) -> list[Series]:
    """Three runs of the quintic motion with more or less noise."""
    return [
        Series(name, evaluate(made_runs.make(folder / name, 2, scatter)).legs[0])
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


def test_the_page_is_whole(drawn: motions.Plans, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "inline_svg", lambda figure, name, description: f"<svg>{name}</svg>")
    runs = series(tmp_path, {QUINTIC: 0.02, CUBIC: 0.2, UNOPTIMISED: 0.02})
    claims = experiment.claims(runs)
    text = sheet.render(claims, drawn, searched(), runs)
    for claim in claims:
        assert claim.what in text
        assert claim.found in text
    for number in (4, 5, 6, 7, 10, 11, 12):
        assert f"<svg>fig{number}</svg>" in text
        assert f"Fig. {number}:" in text
    assert 'replays of each motion</td><td data-column="value">2<' in text


def test_a_replay_that_fails_ends_the_others(
    drawn: motions.Plans, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def replayed(plan: object, folder: Path, times: int, stop: StopRequest, tell: object) -> Path:
        if folder.name == CUBIC:
            raise LinkError("out")
        while not stop.wanted:
            time.sleep(0.01)
        return folder

    monkeypatch.setattr(experiment, "_replayed", replayed)
    with pytest.raises(LinkError, match="out"):
        experiment.run(drawn, tmp_path, True, None)


def test_an_interrupt_ends_all(drawn: motions.Plans, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def replayed(plan: object, folder: Path, times: int, stop: StopRequest, tell: object) -> Path:
        stop.wanted = True
        return folder

    monkeypatch.setattr(experiment, "_replayed", replayed)
    with pytest.raises(KeyboardInterrupt):
        experiment.run(drawn, tmp_path, True, None)


def test_the_three_motions_are_the_paper_s(
    drawn: motions.Plans, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = {}

    def replayed(plan: motions.Plan, folder: Path, times: int, stop: object, tell: object) -> Path:
        seen[folder.name] = (plan.trajectory.joints[0].degree, plan.trajectory.joints[0].duration_s, times)
        return made_runs.make(folder, 1)

    monkeypatch.setattr(experiment, "_replayed", replayed)
    cubic = motions.motion([float(via[0]) for via in drawn.job.via], [1.0] * 6, 3)  # type: ignore[index]
    plan = changed(drawn.cubic, trajectory=replace(drawn.cubic.trajectory, joints=(cubic,) * 3))
    experiment.run(replace(drawn, cubic=plan), tmp_path, False, None)
    assert seen[UNOPTIMISED] == (5, pytest.approx(12.0), 10)
    assert seen[CUBIC][0] == 3
    assert seen[QUINTIC] == (5, drawn.quintic.trajectory.joints[0].duration_s, 10)
