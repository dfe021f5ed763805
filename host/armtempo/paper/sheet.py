"""The page that ``armtempo paper`` writes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armtempo.kinematics import chain
from armtempo.paper import motions, searches
from armtempo.paper.experiment import CUBIC, QUINTIC, Series
from armtempo.paper.printed import DIFFERS, Claim
from armtempo.paper.searches import Row
from armtempo.report import arm_picture, drawing, html_page, plots, run_report, sections
from armtempo.splines.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TITLE = "The paper, repeated"
_LEAD = (
    "Every number of “Time-optimal trajectory planning of serial manipulator based on adaptive cuckoo search "
    "algorithm” and the one that armtempo finds. Written by: armtempo paper"
)


def render(
    claims: Sequence[Claim], made: motions.Plans, searched: Sequence[Row], series: Sequence[Series]
) -> str:
    """The whole page as HTML text."""
    sheet = html_page.Page(_TITLE, _LEAD)
    for where in dict.fromkeys(claim.where for claim in claims):
        sheet.heading(where)
        sheet.table(
            ("what", "printed", "here", "verdict", "remark"),
            [_row(claim) for claim in claims if claim.where == where],
        )
    sheet.heading("Figures")
    for name, figure, caption in _figures(made, searched, series):
        sheet.figure(drawing.inline_svg(figure, name, caption), caption)
    sheet.heading("How to repeat it")
    sheet.code("armtempo paper")
    sections.origin(sheet, made.quintic, _extent(searched, series))
    return sheet.render()


def _extent(searched: Sequence[Row], series: Sequence[Series]) -> list[tuple[str, str]]:
    """The amount of computation; ``--quick`` reduces it."""
    populations = ", ".join(str(population) for population in sorted({row.population for row in searched}))
    return [
        ("populations searched with", populations),
        ("seeds for each", str(min(row.seeds for row in searched))),
        ("replays of each motion", str(min(len(one.found.repetitions) for one in series))),
    ]


def _row(claim: Claim) -> tuple[object, ...]:
    differs = html_page.OPEN if claim.because else html_page.BAD
    kind = differs if claim.verdict == DIFFERS else html_page.GOOD
    return claim.what, claim.printed, claim.found, (claim.verdict, kind), claim.because


def _figures(
    made: motions.Plans, searched: Sequence[Row], series: Sequence[Series]
) -> list[tuple[str, Figure, str]]:
    names = [joint.name for joint in made.arm.driven]
    limits = [joint.limits for joint in made.arm.driven]

    def unoptimised(degree: int, joints: int) -> Figure:
        splines = tuple(motions.unoptimised(made.job, joint, degree) for joint in range(joints))
        return plots.motion(Trajectory("", splines, False), limits[:joints], names[:joints])

    drawn = [
        ("fig4", unoptimised(3, 1), "Fig. 4: joint 1 before optimisation, cubic."),
        ("fig5", unoptimised(5, len(names)), "Fig. 5: the joints before optimisation, quintic."),
        ("fig6", searches.figure(searched), "Fig. 6: the searches' convergence over their seeds."),
        ("fig7", plots.motion(made.quintic.trajectory, limits, names), "Fig. 7: the optimised motion."),
        ("fig10", _postures(made), "Fig. 10: the arm at the via points and the path of its tool."),
    ]
    by_name = {one.name: one.found for one in series}
    for number, name in (("11", QUINTIC), ("12", CUBIC)):
        caption = f"Fig. {number}: {name}, mean of {len(by_name[name].repetitions)} replays against theory."
        drawn.append((f"fig{number}", run_report.figures(by_name[name])["tracking"][0], caption))
    return drawn


def _postures(made: motions.Plans) -> Figure:
    plan = made.quintic
    times = np.linspace(0.0, plan.trajectory.duration_s, 300)
    path = chain.tool_path_mm(made.arm, plan.trajectory, times)
    return arm_picture.postures(chain.chains_mm(made.arm, plan.via_deg), path)
