"""A plan in a few lines of text: motion times, extremes beside their limits, distance to the floor."""

from __future__ import annotations

from armtempo.plan import Plan

_HEAD = (
    f"{'joint':<12}{'time':>10}{'speed':>18}{'acceleration':>18}{'jerk':>18}",
    f"{'':<12}{'s':>10}{'deg/s':>18}{'deg/s²':>18}{'deg/s³':>18}",
)


def lines(plan: Plan) -> list[str]:
    """The summary, one string a line: each extreme as reached / limit."""
    job = plan.job
    made = f"{job.optimiser}, {job.population} x {job.iterations}, seed {job.seed}"
    text = [
        f"{job.name}: {plan.trajectory.duration_s:.4f} s, {job.timing} timing, degree {job.degree}, {made}"
    ]
    text.extend(_HEAD)
    for joint, spline, extreme in zip(plan.arm.driven, plan.trajectory.joints, plan.extremes, strict=True):
        assert joint.limits is not None
        pairs = zip(extreme.values, joint.limits.values, strict=True)
        cells = "".join(f"{f'{value:.2f} / {limit:g}':>18}" for value, limit in pairs)
        text.append(f"{joint.name:<12}{spline.duration_s:>10.4f}{cells}")
    return text
