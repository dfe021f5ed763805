"""Via points that are taught one by one, and the job file that they become."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.cli.keys import END, INTERRUPT, Keys
from armtempo.formats.atomic_file import replace_text
from armtempo.model import job_text, posture_text
from armtempo.model.arm import Arm

TAKE, UNDO = "p", "u"
_BY_HAND_S = 0.3


class TaughtPoints:
    """The points so far; ``where`` gives the posture of the arm, (J,) in degrees."""

    def __init__(self, arm: Arm, where: Callable[[], Array]) -> None:
        self.points_deg: list[list[float]] = []
        self._arm = arm
        self.where = where

    @property
    def keys(self) -> dict[str, Callable[[], str]]:
        """What the keys do that a screen has for them."""
        return {TAKE: self.take, UNDO: self.undo}

    def take(self) -> str:
        """Take where the arm stands; says what was done."""
        point = posture_text.digits(self._arm, self.where().tolist())
        if problem := self._arm.angles_problem(point):
            return f"not taken: {problem}"
        if self.points_deg and point == self.points_deg[-1]:
            return "not taken: the arm stands where it stood at the last point"
        self.points_deg.append(point)
        return f"point {len(self.points_deg)} taken: {_row(point)}"

    def undo(self) -> str:
        """Forget the last point."""
        if not self.points_deg:
            return "there is no point to forget"
        self.points_deg.pop()
        return f"point {len(self.points_deg) + 1} forgotten"

    def save(self, file: Path) -> None:
        """Write the job; InputError for fewer than two points."""
        text = job_text.of_points(job_text.name_of(file), self.points_deg)
        replace_text(file, text)
        click.echo(
            f"written: {file}, {len(self.points_deg)} via points; 'armtempo plan --job {file}' plans it"
        )

    def tell(self) -> None:
        """Print the points, where they cannot become a file: nothing that was taught is lost."""
        for point in self.points_deg:
            click.echo(f"[[via]]\nangles_deg = [{_row(point)}]", err=True)


def check_free(file: Path, replace_old: bool) -> None:
    """InputError where the job file is there already, before anything moves."""
    if file.exists() and not replace_old:
        raise InputError(f"{file} exists, so it is kept", "choose another name, or replace it with --replace")
    if not file.parent.is_dir():
        raise InputError(f"{file.parent}: there is no such folder", "make it, or choose another place")


def by_hand(keys: Keys, points: TaughtPoints, button: Callable[[], bool] = lambda: False) -> None:
    """Take points while the arm is moved by hand, until q, Ctrl-C or the end of the input.

    ``button``: whether the board's button, which takes a point too, was pressed since it was asked last.
    """
    said = ""
    while True:
        shown = f"{_row(points.where().round(2).tolist())} ° by the encoders"
        click.echo(
            f"\r\x1b[K{len(points.points_deg)} points | {shown}{' | ' if said else ''}{said}", nl=False
        )
        key = keys.read(_BY_HAND_S)
        if key in ("q", "Q", END):
            break
        if key == INTERRUPT:
            click.echo()
            raise KeyboardInterrupt
        if key in points.keys:
            said = points.keys[key]()
        if button():
            said = points.take()
    click.echo()


def _row(point: list[float]) -> str:
    return ", ".join(f"{angle + 0.0:.12g}" for angle in point)
