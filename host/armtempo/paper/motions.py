"""The paper's motions: before optimisation, with the printed intervals, and planned by armtempo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.plan import Plan
from armtempo.paper import printed
from armtempo.paper.printed import BETTER, DIFFERS, SAME, Claim, compared
from armtempo.planning import planner
from armtempo.splines import bspline, extremes, time_axis
from armtempo.splines.trajectory import JointSpline

UNOPTIMISED_S = 2.0


@dataclass(frozen=True)
class Plans:
    """The shipped job, planned with quintic and with cubic splines."""

    arm: Arm
    job: Job
    quintic: Plan
    cubic: Plan


def plans() -> Plans:
    """Plan the shipped job both ways."""
    arm, feed = Arm.paper(), Job.paper()
    return Plans(
        arm, feed, planner.plan(arm, feed), planner.plan(arm, replace(feed, name="feed-cubic", degree=3))
    )


def motion(via_deg: Sequence[float], intervals_s: Sequence[float], degree: int) -> JointSpline:
    """One joint through ``via_deg`` (n + 1,) with the given intervals (n,)."""
    points = bspline.fit(np.array(via_deg), degree)
    return JointSpline(degree, 1, points, time_axis.control_points(np.array(intervals_s), degree))


def unoptimised(feed: Job, joint: int, degree: int) -> JointSpline:
    """A joint of the shipped job with equal intervals of 2 s (Figs. 4 and 5)."""
    via = _via(feed, joint)
    return motion(via, [UNOPTIMISED_S] * (len(via) - 1), degree)


def claims(made: Plans) -> list[Claim]:
    """Section 2.3's peaks, Table 6, and the two percentages."""
    return [*_peaks(made.job), *_table_6(made), _reduction(made), _cubic_gain(made)]


def _via(feed: Job, joint: int) -> list[float]:
    return [float(via[joint]) for via in feed.via if isinstance(via, tuple)]


def _peaks(feed: Job) -> list[Claim]:
    reached = extremes.of_joint(unoptimised(feed, 0, 5))
    where = "section 2.3"
    speed, acceleration = printed.UNOPTIMISED_PEAKS
    return [
        compared(where, "joint 1 before optimisation, peak speed (°/s)", speed, reached.speed_deg_s, 2),
        compared(
            where,
            "joint 1 before optimisation, peak acceleration (°/s²)",
            acceleration,
            reached.acceleration_deg_s2,
            2,
        ),
    ]


def _table_6(made: Plans) -> list[Claim]:
    found = []
    for joint, total in enumerate(printed.TOTALS_S):
        ours = made.quintic.trajectory.joints[joint].duration_s
        found.append(_total(f"joint {joint + 1}, motion time (s)", total, ours))
        found.append(_printed_intervals(made, joint))
    return found


def _total(what: str, total: float, ours: float) -> Claim:
    verdict = SAME if abs(ours - total) <= 0.0015 else BETTER if ours < total else DIFFERS
    because = {
        SAME: "",
        BETTER: "the search finds a better optimum with the same limits",
        DIFFERS: "another seed of a random search; all limits are kept exactly, not to three digits",
    }[verdict]
    return Claim("Table 6", what, f"{total:.3f}", f"{ours:.4f}", verdict, because)


def _printed_intervals(made: Plans, joint: int) -> Claim:
    """Whether the printed intervals keep the limits."""
    limits = made.arm.driven[joint].limits
    reached = extremes.of_joint(motion(_via(made.job, joint), printed.INTERVALS_S[joint], 5)).values
    share = float(np.max(reached / np.array(limits.values)))
    because = "" if share <= 1.0 else "rounding of the printed intervals"
    if joint == 2:
        because = "with P5 = −20°, as −15° in Table 3 is a misprint (it gives 51.6 °/s² and 246 °/s³)"
    verdict = SAME if share < 1.006 else DIFFERS
    what = f"joint {joint + 1}, the printed intervals keep the limits (largest share)"
    return Claim("Table 6", what, "≤ 100 %", f"{100 * share:.2f} %", verdict, because)


def _reduction(made: Plans) -> Claim:
    total = sum(joint.duration_s for joint in made.quintic.trajectory.joints)
    share = 1 - total / (3 * 6 * UNOPTIMISED_S)
    verdict = (
        SAME if abs(share - printed.REDUCTION) < 0.0005 else BETTER if share > printed.REDUCTION else DIFFERS
    )
    because = "the 28 % of the conclusions is a misprint: Table 6 gives 46.4 %"
    where, what = "section 3.3", "motion time saved over the three joints"
    return Claim(where, what, f"{printed.REDUCTION:.1%}", f"{share:.2%}", verdict, because)


def _cubic_gain(made: Plans) -> Claim:
    quintic, cubic = (plan.trajectory.joints[0].duration_s for plan in (made.quintic, made.cubic))
    return compared(
        "section 4.2",
        "joint 1, cubic shorter than quintic by (share)",
        printed.CUBIC_GAIN,
        1 - cubic / quintic,
        3,
        "both searches end within a few tenths of a percent of their optima, which differ by 6.95 %",
    )
