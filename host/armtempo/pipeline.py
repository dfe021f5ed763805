"""The whole chain, from via points to pulses and from encoder counts to a page; read this first.

::

    plan     arm and job -> Plan              planning: via angles, path, time axes, checks
    load     file of a plan -> Plan           model.plan
    run      Plan -> records -> board         encoding, link, robot.running; there evaluator, rings, timers
             board -> samples -> run folder   link.follow, report.run_folder
    report   run folder -> page and figures   Run.report

Each stage needs only the result of the previous one, and each result can be stored: a plan in a file, a
motion on the board, a run in its folder.
"""

from __future__ import annotations

from collections import abc
from pathlib import Path

from armtempo.basics.arguments import checked
from armtempo.basics.errors import RunFolderError
from armtempo.basics.progress import Progress, part
from armtempo.encoding import made_with
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.model.sequence import Sequence
from armtempo.planning import checks, planner, sequence_planner
from armtempo.planning import split as cut
from armtempo.report import comparison, text_summary
from armtempo.report.run import Run
from armtempo.robot.connect import connect
from armtempo.robot.recording import Watcher

__all__ = [
    "compare",
    "connect",
    "load",
    "plan",
    "plan_sequence",
    "run",
    "split",
    "summary",
]


@checked
def plan(arm: Arm | Path | str, job: Job | Path | str, progress: Progress | None = None) -> Plan:
    """Plan the shortest motion that the job's search finds through its via points, from rest to rest.

    ``arm``, ``job``: objects or files; ``arm`` also the name of a shipped arm.

    The same arm, job and seed give the same plan on the same machine and versions. Raises InputError if job
    and arm do not fit each other, PlanError if there is no motion within the limits and ranges.
    """
    arm = Arm.of(arm)
    return planner.plan(arm, Job.of(job, arm), progress)


@checked
def plan_sequence(
    arm: Arm | Path | str, sequence: Sequence | Path | str, progress: Progress | None = None
) -> Plan:
    """Plan all motions of a sequence (or of its file), each from the end of the one before; raises as
    ``sequence_planner.plan``."""
    arm = Arm.of(arm)
    return sequence_planner.plan(arm, Sequence.of(sequence, arm), progress)


def split(arm: Arm, job: Job, progress: Progress | None = None) -> list[Plan]:
    """Plan the job in parts from rest to rest, each short enough for the board; one part if the whole job is.

    For the spline through the via points, which rests only at its ends, there is one part for each section
    between stops. Raises PlanError if a part is still too long or there is no stop; otherwise as ``plan``.
    """
    if checks.is_free(job) or not job.stops:
        whole = planner.plan(arm, job, progress)
        if whole.total_s <= cut.LONGEST_S:
            return [whole]
        parts = cut.at_few_stops(whole.job, whole.via_deg, whole.trajectory)
    else:
        points = planner.points_of(arm, job)
        parts = cut.at_all_stops(points.job, points.via_deg)
    return [planner.plan(arm, one, part(progress, number, len(parts))) for number, one in enumerate(parts)]


@checked
def summary(plan: Plan, verbose: bool = False) -> list[str]:
    """A plan in a few lines: motion time next to its lower bound, extremes next to their limits, what would be faster.

    ``verbose``: also the search, the kind of bound, and what the board has to do for it.
    """
    return text_summary.lines(plan, verbose)


def load(path: Path | str, arm: Arm | None = None, altered: bool = False) -> Plan:
    """The plan of a file, of a motion or a sequence.

    ``altered``: accept a file that was altered after it had been written. Raises InputError if it is no
    plan's file, is damaged or altered, or was planned for another arm than ``arm``, or for one of its frames
    that has changed since.
    """
    found = Plan.load(path, altered)
    if arm is not None:
        made_with.check_plan(path, found, arm)
    return found


def run(
    plan: Plan,
    port: str | None = None,
    repeat: int = 1,
    out: Path | str = "runs",
    progress: Progress | None = None,
    watcher: Watcher | None = None,
) -> Run:
    """Replay and record a plan on the board of ``port`` (as in ``connect``): opens the port, calls
    ``Board.run``, closes it.
    """
    with connect(port, plan.arm) as board:
        return board.run(plan, repeat, out, progress, watcher)


@checked
def compare(folders: abc.Sequence[Path | str], page: Path | str | None = None) -> Path:
    """Write one page that compares recorded runs, by default next to the first; returns the page.

    The page names folders that cannot be read. Raises RunFolderError if fewer than two can be read.
    """
    paths = [Path(folder) for folder in folders]
    if not paths:
        raise RunFolderError("no run folders to compare", "give at least two")
    return comparison.write(paths, Path(page) if page else paths[0].parent / comparison.PAGE)
