"""Section 4: the motions replayed ten times on the virtual arm, compared with Figs. 11 and 12."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from armtempo.basics.progress import Progress
from armtempo.model.leg import JobSolution
from armtempo.model.plan import Plan
from armtempo.paper import motions, printed
from armtempo.paper.printed import DIFFERS, SAME, Claim
from armtempo.ports.names import SIM
from armtempo.report import analysis, peaks
from armtempo.report.evaluation import LegEvaluation, evaluate
from armtempo.robot.connect import connect
from armtempo.robot.stop_request import StopRequest
from armtempo.splines import extremes
from armtempo.splines.trajectory import Trajectory

REPETITIONS = 10
QUICK_REPETITIONS = 2
_LOOK_S = 0.2
_END_S = 0.5
QUINTIC, CUBIC, UNOPTIMISED = "quintic", "cubic", "unoptimised"


@dataclass(frozen=True)
class Series:
    """One motion, replayed and analysed."""

    name: str
    found: LegEvaluation


def run(made: motions.Plans, folder: Path, quick: bool, progress: Progress | None) -> list[Series]:
    """Replay the three motions in parallel, each on its own virtual board; run folders are made in ``folder``.

    All of them brake after Ctrl-C, which raises Stopped, or after an error in one of them, which is raised.
    """
    plans = {QUINTIC: made.quintic, CUBIC: made.cubic, UNOPTIMISED: _unoptimised(made)}
    times = QUICK_REPETITIONS if quick else REPETITIONS
    shares = dict.fromkeys(plans, 0.0)
    with StopRequest() as stop:
        with ThreadPoolExecutor(len(plans)) as pool:
            replays = {
                name: pool.submit(
                    _replayed, plan, folder / name, times, stop, partial(shares.__setitem__, name)
                )
                for name, plan in plans.items()
            }
            while wait(replays.values(), _LOOK_S, FIRST_EXCEPTION).not_done:
                stop.wanted = stop.wanted or any(map(_failed, replays.values()))
                if progress is not None:
                    progress(sum(shares.values()), len(plans))
        for replay in filter(_failed, replays.values()):
            replay.result()
    return [Series(name, evaluate(replay.result()).legs[0]) for name, replay in replays.items()]


def claims(series: list[Series]) -> list[Claim]:
    """The three comparisons of section 4.2 in numbers."""
    by_name = {one.name: one.found for one in series}
    return [
        *_coincide(by_name[QUINTIC]),
        *_limits_kept(by_name[QUINTIC]),
        *_unoptimised_peaks(by_name[UNOPTIMISED]),
        *_rougher_ends(by_name[QUINTIC], by_name[CUBIC]),
    ]


def _unoptimised(made: motions.Plans) -> Plan:
    """The plan of the shipped job with equal intervals of 2 s."""
    joints = tuple(motions.unoptimised(made.job, joint, 5) for joint in range(len(made.arm.driven)))
    plan, name = made.quintic, "feed-unoptimised"
    found = tuple(map(extremes.of_joint, joints))
    solution = JobSolution(replace(made.job, name=name), plan.via_deg, (), found)
    return Plan.of_job(plan.arm, solution, Trajectory(name, joints, False), plan.notes, plan.versions)


def _replayed(plan: Plan, folder: Path, times: int, stop: StopRequest, tell: Callable[[float], None]) -> Path:
    """The run folder of one motion; ``tell`` is called with the finished fraction of the work."""
    with connect(SIM, plan.arm) as board:
        return board.run(plan, times, folder, lambda done, whole: tell(done / whole), stop=stop).path


def _failed(replay: Future[Path]) -> bool:
    return replay.done() and not isinstance(replay.exception(), KeyboardInterrupt | None)


def _coincide(found: LegEvaluation) -> list[Claim]:
    """ "The angle curves almost coincide": within the rounding of the encoder and the lag of the motor."""
    rows = analysis.deviations(found.curves)[0]
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


def _limits_kept(found: LegEvaluation) -> list[Claim]:
    claims = []
    for name, checks in zip(found.names, found.limit_checks, strict=True):
        for quantity, check in zip(("speed", "acceleration"), checks, strict=True):
            kept = check.verdict != peaks.EXCEEDED
            claims.append(
                Claim(
                    "Fig. 11",
                    f"{name}, {quantity} keeps its limit of {check.limit:g}",
                    "satisfied",
                    f"{check.peak:.2f} ± {check.sigma:.2f}, {check.verdict}",
                    SAME if kept else DIFFERS,
                    "" if kept else "the motor's ringing adds to the command",
                )
            )
    return claims


def _unoptimised_peaks(found: LegEvaluation) -> list[Claim]:
    """Joint 1 before optimisation: the peaks of section 2.3, as measured."""
    checks = found.limit_checks[0]
    claims = []
    for quantity, unit, value, check in zip(
        ("speed", "acceleration"), ("°/s", "°/s²"), printed.UNOPTIMISED_PEAKS, checks, strict=True
    ):
        same = abs(check.peak - value) <= 3.0 * check.sigma
        because = "" if same else "largest of many noisy values, and the motor's ringing"
        what = f"joint 1 before optimisation, peak {quantity} measured ({unit})"
        text = f"{check.peak:.2f} ± {check.sigma:.2f}"
        claims.append(Claim("section 2.3", what, f"{value:.2f}", text, SAME if same else DIFFERS, because))
    return claims


def _rougher_ends(quintic: LegEvaluation, cubic: LegEvaluation) -> list[Claim]:
    """Joint 1 at start and end: deviation of speed and acceleration, cubic compared with quintic."""
    claims = []
    for order, unit, said in (
        (1, "°/s", "cubic lags evidently, quintic does not"),
        (2, "°/s²", "quintic has less error"),
    ):
        what = f"joint 1, {analysis.ORDERS[order]} off theory in the first and last {_END_S:g} s (RMS)"
        quiet, rough = (_end_error(found, order) for found in (quintic, cubic))
        found = f"cubic {rough:.2f}, quintic {quiet:.2f} {unit}: {rough / quiet:.1f} times"
        claims.append(Claim("Fig. 12", what, said, found, SAME if rough > quiet else DIFFERS))
    return claims


def _end_error(found: LegEvaluation, order: int) -> float:
    """RMS deviation of joint 1's mean curve from ``Curves.shown`` near start and end."""
    end = found.trajectory.joints[0].duration_s
    times = found.curves.times_s
    near = (times <= _END_S) | ((times >= end - _END_S) & (times <= end + _END_S))
    error = (found.curves.mean - found.curves.shown)[order, near, 0]
    return float(np.sqrt(np.nanmean(error**2)))
