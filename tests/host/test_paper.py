"""The paper repeated: each table's claims say what they should, and a wrong result would show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from armtempo.paper import motions, postures, printed, searches
from armtempo.paper.printed import BETTER, DIFFERS, SAME, compared

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
    claims = motions.claims(replace(made, quintic=replace(made.quintic, trajectory=trajectory)))
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


def test_searches_on_all_cores(made: motions.Plans, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(searches, "QUICK_POPULATIONS", (4,))
    monkeypatch.setattr(searches, "QUICK_SEEDS", 1)
    told: list[tuple[int, int]] = []
    rows = searches.run(made.arm, made.job, True, lambda done, whole: told.append((done, whole)))
    assert [row.algorithm for row in rows] == list(printed.SEARCHES_S)
    assert told[-1] == (6, 6)
    search = searches._Search.of(made.arm, made.job)
    assert rows[-1].curves[2] == pytest.approx(search(("acs", 4, 1))[1])
