"""``armtempo teach``: stores the arm's position as a posture in its file, or as via points of a job."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from armtempo.basics.arrays import Array
from armtempo.basics.atomic_file import replace_text
from armtempo.basics.errors import InputError
from armtempo.basics.settings import ARM, ProjectSettings, missing_setting
from armtempo.cli import jog, keys, options, resolve, results
from armtempo.cli.keys import END, INTERRUPT, Keys
from armtempo.cli.options import BoardOptions
from armtempo.model import posture, shipped, taught
from armtempo.model.arm import Arm
from armtempo.robot.board import Board


@click.command("teach")
@click.argument("job_file", required=False, metavar="[JOB.toml]", type=options.FILE)
@click.option(
    "--posture", "name", metavar="NAME", help="Write the position as [posture.NAME] into the arm file."
)
@click.option("--by-hand", is_flag=True, help="Switch the motors' current off and follow the encoders.")
@click.option(
    "--replace", "replace_old", is_flag=True, help="Replace the posture, or the job file, of that name."
)
@options.gamepad
@options.arm_of_board
@options.port
@options.log_traffic
def teach(
    job_file: Path | None,
    name: str | None,
    by_hand: bool,
    replace_old: bool,
    gamepad: bool,
    arm_path: Path | None,
    port: str | None,
    log_traffic: Path | None,
) -> None:
    """Teach: store the arm's present position.

    JOB.toml: a new job file for the via points: move by the keys of 'armtempo jog' and press p for a point,
    or move the arm --by-hand. --posture NAME writes one posture into the arm file and keeps its comments and
    layout; nothing moves. Then 'armtempo goto NAME' moves the arm there, and a job can use it: [[via]]
    posture = "NAME".
    """
    if (job_file is None) == (name is None) or (name is not None and by_hand):
        raise InputError(
            "give either a job file or a posture", "give JOB.toml, or --posture NAME without --by-hand"
        )
    if gamepad and (by_hand or name is not None):
        raise InputError("--gamepad is for teach JOB.toml by keys", "leave it out")
    if name is not None:
        file = _own_arm_file(arm_path, name)
        arm = resolve.load_arm(arm_path)
        with resolve.board(BoardOptions(port, log_traffic), arm) as board:
            jog.prepare(board, arm)
            _write_posture(board, file, name, replace_old)
    elif job_file is not None:
        check_free(job_file, replace_old)
        if not keys.is_terminal():
            raise InputError("teach by keys needs a terminal", "run it in one")
        named = resolve.named_arm(arm_path)
        with resolve.board(BoardOptions(port, log_traffic), named) as board:
            jog.prepare(board, resolve.arm_of_board(board, named))
            _write_job(board, job_file, by_hand, gamepad)


def _own_arm_file(arm_path: Path | None, name: str) -> Path:
    """The arm file to write to; raises InputError for a shipped arm, and for an invalid posture name."""
    if problem := posture.name_problem(name):
        raise InputError(f"--posture {name}: {problem}", "choose another name")
    setting = ProjectSettings().get(ARM, arm_path)
    if not setting:
        raise missing_setting(ARM, "no arm file is set")
    found = shipped.find(setting.path)
    if found.ships or found.path.resolve() in [path.resolve() for path in shipped.files().values()]:
        raise InputError(
            f"the arm file {found.path.name} belongs to armtempo and is not changed",
            f"make a copy: armtempo new FOLDER --like {found.path.stem}, then give it with --arm",
        )
    return found.path


def _write_posture(board: Board, file: Path, name: str, replace_old: bool) -> None:
    arm = board.arm
    assert arm is not None  # it was configured
    angles_deg = taught.digits(arm, board.posture_deg().tolist())
    taught.save(file, arm, name, angles_deg, replace_old)
    words = ", ".join(
        f"{joint.name} {angle:.12g}°" for joint, angle in zip(arm.driven, angles_deg, strict=True)
    )
    results.echo(f"{file}: posture {name!r}: {words}")


def _write_job(board: Board, file: Path, by_hand: bool, gamepad: bool) -> None:
    """Collect the points and write them; print them if that fails."""
    arm = board.arm
    assert arm is not None  # it was configured
    points = TaughtPoints(arm, board.posture_deg)
    try:
        with jog.pressed_keys(board, gamepad) as pressed:
            if by_hand:
                _guide(board, pressed, points)
            else:
                jog.screen(board, pressed, more=points.keys, more_help=_MORE).loop()
        points.save(file)
    except BaseException:
        points.tell()
        raise


_MORE = "  p            take a point                   u       forget the last one"


def _guide(board: Board, pressed: Keys, points: TaughtPoints) -> None:
    guided = board.by_hand()
    results.echo(
        "hold the arm: it sinks when the motors' current goes off. Enter: off; any other key: leave it on"
    )
    if pressed.read(600.0) not in ("\r", "\n"):
        raise InputError("the motors kept their current", "run it again while someone holds the arm")
    points.where = guided.angles_deg
    with guided:
        results.echo(
            "the current is off. p or the board's button takes a point, u removes the last, q gives the current back "
            "and ends"
        )
        by_hand(pressed, points, guided.button_pressed)


TAKE, UNDO = "p", "u"
_BY_HAND_S = 0.3


class TaughtPoints:
    """The points taught up to now; ``where`` returns the posture of the arm, degrees (J,)."""

    def __init__(self, arm: Arm, where: Callable[[], Array]) -> None:
        self.points_deg: list[list[float]] = []
        self._arm = arm
        self.where = where

    @property
    def keys(self) -> dict[str, Callable[[], str]]:
        """The keys for the jog screen, with their functions."""
        return {TAKE: self.take, UNDO: self.undo}

    def take(self) -> str:
        """Store the arm's position; returns a message."""
        point = taught.digits(self._arm, self.where().tolist())
        if problem := self._arm.angles_problem(point):
            return f"not taken: {problem}"
        if self.points_deg and point == self.points_deg[-1]:
            return "not taken: the arm is at the last point"
        self.points_deg.append(point)
        return f"point {len(self.points_deg)} taken: {_row(point)}"

    def undo(self) -> str:
        """Remove the last point; returns a message."""
        if not self.points_deg:
            return "there is no point to remove"
        self.points_deg.pop()
        return f"point {len(self.points_deg) + 1} removed"

    def save(self, file: Path) -> None:
        """Write the job; raises InputError for fewer than two points."""
        text = taught.of_points(taught.name_of(file), self.points_deg)
        replace_text(file, text)
        results.echo(
            f"written: {file}, {len(self.points_deg)} via points; 'armtempo plan --job {file}' plans it"
        )

    def tell(self) -> None:
        """Print the points if the file cannot be written, so that they are not lost."""
        for point in self.points_deg:
            click.echo(f"[[via]]\nangles_deg = [{_row(point)}]", err=True)


def check_free(file: Path, replace_old: bool) -> None:
    """Raise InputError if the job file exists; called before anything moves."""
    if file.exists() and not replace_old:
        raise InputError(f"{file} already exists", "choose another name, or replace it with --replace")
    if not file.parent.is_dir():
        raise InputError(f"{file.parent}: there is no such folder", "make it, or choose another place")


def by_hand(keys: Keys, points: TaughtPoints, button: Callable[[], bool] = lambda: False) -> None:
    """Store points while the arm is moved by hand, until q, Ctrl-C or the end of the input.

    ``button``: whether the board's button, which stores a point too, was pressed since the last call.
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
            results.echo()
            raise KeyboardInterrupt
        if key in points.keys:
            said = points.keys[key]()
        if button():
            said = points.take()
    results.echo()


def _row(point: list[float]) -> str:
    return ", ".join(f"{angle + 0.0:.12g}" for angle in point)
