"""Table 4 and Fig. 6: six searches, four populations, the paper's own fitness, Eq. (21)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armtempo.basics.progress import Progress
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.research.bench import cases, worker_pool
from armtempo.research.bench.result_store import ResultStore
from armtempo.research.bench.result_table import PAPER, Row, rows
from armtempo.research.paper.claims import BETTER, DIFFERS, SAME, Claim

FITNESS = "penalised"
ITERATIONS = 500
POPULATIONS = (10, 50, 100, 500)
QUICK_POPULATIONS = (10, 50)
_SAME_S = 0.02
"""Best values of one run of a random search: this near counts as the same."""
_BECAUSE = {
    SAME: "",
    BETTER: "the paper does not say how its operators are tuned; ours are in docs/optimisers.md",
    DIFFERS: "printed is one run of a random search, here is the median over seeds",
}


def run(arm: Arm, job: Job, folder: Path, quick: bool, progress: Progress) -> list[Row]:
    """The comparison, on all cores; runs already in ``folder`` are not repeated."""
    problem = cases.problem_of(arm, job, 1, FITNESS, ITERATIONS)
    seeds = range(1, 4 if quick else 11)
    wanted = cases.cases(PAPER, QUICK_POPULATIONS if quick else POPULATIONS, seeds)
    store = ResultStore(folder, problem)
    todo = [case for case in wanted if case not in store.runs]
    if todo:
        with worker_pool.local() as executor:
            for number, done in enumerate(cases.execute(problem, todo, executor), 1):
                store.add(done)
                progress(number, len(todo))
    return rows((store.runs[case] for case in wanted), ITERATIONS)


def claims(found: Sequence[Row]) -> list[Claim]:
    """Our median beside the printed value; the range over the seeds is told with it."""
    return [_claim(row) for row in found]


def _claim(row: Row) -> Claim:
    printed = PAPER[row.algorithm][row.population][0]
    verdict = SAME
    if abs(row.median_s - printed) > _SAME_S:
        verdict = BETTER if row.median_s < printed else DIFFERS
    because = _BECAUSE[verdict]
    text = f"{row.median_s:.3f} ({row.best_s:.3f} to {row.worst_s:.3f})"
    what = f"{row.algorithm.upper()}, population {row.population}, fitness of joint 1 (s)"
    return Claim("Table 4", what, f"{printed:.3f}", text, verdict, because)
