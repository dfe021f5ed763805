"""``armtempo paper``: the paper's tables and figures, repeated."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from armtempo.basics.atomic_file import replace_text
from armtempo.cli import options, results
from armtempo.cli.results import ProgressBar
from armtempo.paper import experiment, motions, postures, searches, sheet
from armtempo.paper.printed import Claim


@click.command("paper")
@click.option("--quick", is_flag=True, help="Small populations, few seeds, two replays: under a minute.")
@options.folder(
    "--out",
    default=Path("paper"),
    show_default=True,
    help="Where page and run folders go.",
)
@options.as_json
def paper(quick: bool, out: Path, as_json: bool) -> None:
    """Repeat the paper: every number next to the printed one.

    The replays run on the virtual board.
    """
    made = motions.plans()
    with ProgressBar("searching") as progress:
        searched = searches.run(made.arm, made.job, quick, progress)
    with ProgressBar("replaying") as progress:
        series = experiment.run(made, out / "runs", quick, progress)
    claims = [
        *postures.claims(made.arm),
        *motions.claims(made),
        *searches.claims(searched),
        *experiment.claims(series),
    ]
    target = out / "paper.html"
    replace_text(target, sheet.render(claims, made, searched, series))
    values = {"page": str(target), "claims": [asdict(claim) for claim in claims]}
    results.show(as_json, values, [*map(_line, claims), f"written: {target}"])


def _line(claim: Claim) -> str:
    line = f"{claim.where:<12} {claim.what:<62} {claim.printed:>14} {claim.found:>24}  {claim.verdict}"
    return f"{line}: {claim.because}" if claim.because else line
