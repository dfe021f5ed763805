"""Section 4: the motions replayed ten times on the virtual arm, and what Figs. 11 and 12 say of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from armtempo import analyse, extremes, operate, pipeline, report
from armtempo.interrupt import StopRequest
from armtempo.link import open_board
from armtempo.link.board import Progress
from armtempo.link.ports import SIM
from armtempo.paper import motions
from armtempo.paper.claims import DIFFERS, SAME, Claim
from armtempo.plan import Plan
from armtempo.trajectory import Trajectory

REPETITIONS = 10
QUICK_REPETITIONS = 2
QUINTIC, CUBIC, UNOPTIMISED = "quintic", "cubic", "unoptimised"


@dataclass(frozen=True)
class Series:
    """One motion, replayed and analysed."""

    name: str
    found: report.Evaluation


def run(made: motions.Plans, folder: Path, quick: bool, progress: Progress | None) -> list[Series]:
    """Replay the three motions on a virtual board each; their run folders go below ``folder``."""
    plans = {QUINTIC: made.quintic, CUBIC: made.cubic, UNOPTIMISED: _unoptimised(made)}
    times = QUICK_REPETITIONS if quick else REPETITIONS
    return [Series(name, _replayed(plan, folder / name, times, progress)) for name, plan in plans.items()]


def claims(series: list[Series]) -> list[Claim]:
    """The three comparisons of section 4.2, in numbers."""
    by_name = {one.name: one.found for one in series}
    return [
        *_coincide(by_name[QUINTIC]),
        *_limits_kept(by_name[QUINTIC]),
        _rougher_ends(by_name[QUINTIC], by_name[CUBIC]),
    ]


def _unoptimised(made: motions.Plans) -> Plan:
    """The plan of the shipped job with equal intervals of 2 s."""
    joints = tuple(motions.unoptimised(made.job, joint, 5) for joint in range(len(made.arm.driven)))
    return replace(
        made.quintic,
        job=replace(made.job, name="feed-unoptimised"),
        trajectory=Trajectory("feed-unoptimised", joints, False),
        extremes=tuple(map(extremes.of_joint, joints)),
        searches=(),
    )


def _replayed(plan: Plan, folder: Path, times: int, progress: Progress | None) -> report.Evaluation:
    motion = pipeline.planned(plan)
    with open_board(SIM, arm=motion.arm) as board, StopRequest() as stop:
        operate.configure(board, motion.arm, replace=True)
        pipeline.bring_to_start(board, SIM, motion, stop)
        run_folder = pipeline.new_run(folder, motion, SIM, board)
        for _ in pipeline.repeat(board, motion, run_folder, times, stop, operate.shown(progress)):
            pass
    return report.evaluate(run_folder.path)


def _coincide(found: report.Evaluation) -> list[Claim]:
    """ "The angle curves almost coincide": within the rounding of the encoder and the lag of the motor."""
    rows = analyse.deviations(found.curves)[0]
    return [
        Claim(
            "Fig. 11",
            f"{name}, angle follows theory (RMS, °)",
            "almost coincide",
            f"{row.rms:.3f}",
            SAME if row.rms < 0.5 else DIFFERS,
        )
        for name, row in zip(found.names, rows, strict=True)
    ]


def _limits_kept(found: report.Evaluation) -> list[Claim]:
    resolutions = report.resolutions_deg(found.plan.arm)
    claims = []
    for name, checks in zip(
        found.names, analyse.limit_checks(found.curves, found.limits, resolutions), strict=True
    ):
        for quantity, check in zip(("speed", "acceleration"), checks, strict=True):
            kept = check.verdict != "exceeded"
            claims.append(
                Claim(
                    "Fig. 11",
                    f"{name}, {quantity} keeps its limit of {check.limit:g}",
                    "satisfied",
                    f"{check.peak:.2f} ± {check.sigma:.2f}, {check.verdict}",
                    SAME if kept else DIFFERS,
                    "" if kept else "the motor's ringing adds to the commanded motion",
                )
            )
    return claims


def _rougher_ends(quintic: report.Evaluation, cubic: report.Evaluation) -> Claim:
    """Joint 1 at start and end: how much rougher the cubic's acceleration is than the quintic's."""
    quiet, rough = (_end_roughness(found) for found in (quintic, cubic))
    return Claim(
        "Fig. 12",
        "joint 1, error of the acceleration in the first and last 0.5 s, cubic over quintic",
        "cubic lags evidently, quintic does not",
        f"{rough:.1f} / {quiet:.1f} °/s² = {rough / quiet:.1f}",
        SAME if rough > quiet else DIFFERS,
    )


def _end_roughness(found: report.Evaluation) -> float:
    """RMS deviation of joint 1's mean acceleration within half a second of start and end, deg/s2."""
    end = found.plan.trajectory.joints[0].duration_s
    times = found.curves.times_s
    near = (times <= 0.5) | ((times >= end - 0.5) & (times <= end + 0.5))
    error = (found.curves.mean - found.curves.shown)[2, near, 0]
    return float(np.sqrt(np.nanmean(error**2)))
