"""``armtempo teach``: a posture, frame or tool of the arm file, or the via points of a job, by the arm's position."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
from armtempo.planning import via_points
from armtempo.robot.board import Board
from armtempo.robot.teaching import NewFrame, NewTable, NewTool


@click.command("teach")
@click.argument("what", nargs=-1, metavar="[WHAT]", shell_complete=options.files)
@click.option(
    "--posture", "name", metavar="NAME", help="Write the position as [posture.NAME] into the arm file."
)
@click.option(
    "--at",
    metavar="NAMES",
    help="Postures of the arm file at the points of a frame or the tip of a tool, with commas, instead of keys: o,x,y.",
)
@click.option("--level", is_flag=True, help="Make the z axis of a frame parallel to the base's.")
@options.tool
@click.option("--by-hand", is_flag=True, help="Switch the motors' current off and follow the encoders.")
@click.option(
    "--replace",
    "replace_old",
    is_flag=True,
    help="Replace the posture, frame, tool or job file of that name.",
)
@options.gamepad
@options.arm_of_board
@options.port
@options.log_traffic
def teach(
    what: tuple[str, ...],
    name: str | None,
    at: str | None,
    level: bool,
    tool: str | None,
    by_hand: bool,
    replace_old: bool,
    gamepad: bool,
    arm_path: Path | None,
    port: str | None,
    log_traffic: Path | None,
) -> None:
    """Teach: store the arm's present position.

    WHAT: a new job file, such as points.toml, for via points; or 'frame NAME' or 'tool NAME' of the arm file. Move
    by the keys of 'armtempo jog' and press p for a point, or move the arm --by-hand. A frame takes three points of
    the tool: its origin, one on its x axis, one on the side of y; [frame.NAME] is written with what they say of
    its accuracy. A tool takes four postures in which its point touches the same tip, turned differently;
    [tool.NAME] is written, with how well they meet. --posture NAME writes the present position as a posture; nothing
    moves. Then 'armtempo goto NAME' moves the arm there, and a job can use it: [[via]] posture = "NAME". The arm
    file keeps its comments and layout.
    """
    kind = what[0] if what[:1] in (("frame",), ("tool",)) else ""
    if len(what) > 1 + bool(kind) or (len(what) < 1 + bool(kind)) == (name is None) or (kind and name):
        raise InputError(
            "give one thing to teach",
            "give JOB.toml, frame NAME, tool NAME, or --posture NAME; nothing else beside it",
        )
    if (level or tool) and kind != "frame":
        raise InputError("--level and --tool are for frames", "armtempo teach frame NAME")
    if at and not kind:
        raise InputError("--at is for frames and tools", "armtempo teach frame NAME")
    if by_hand and (name or at):
        raise InputError("--by-hand is for points that are taken one by one", "leave it out")
    if gamepad and (by_hand or name or at):
        raise InputError("--gamepad is for teaching by keys", "leave it out")
    board_options = BoardOptions(port, log_traffic)
    if name is not None:
        if problem := posture.name_problem(name):
            raise InputError(f"--posture {name}: {problem}", "choose another name")
        file, arm = _own_arm_file(arm_path), resolve.load_arm(arm_path)
        with resolve.board(board_options, arm) as board:
            jog.prepare(board, arm)
            _write_posture(board, file, name, replace_old)
        return
    if kind:
        file, arm = _own_arm_file(arm_path), resolve.load_arm(arm_path).with_tool(tool)
        new = (
            NewFrame(file, arm, what[1], level, replace_old)
            if kind == "frame"
            else NewTool(file, arm, what[1], replace_old)
        )
        if at is not None:
            for line in new.save(postures_deg(arm, at.split(","), new.points)):
                results.echo(line)
            return
        _check_terminal()
        with resolve.board(board_options, arm) as board:
            jog.prepare(board, arm)
            _collect(board, NamedPoints(arm, board.posture_deg, new), by_hand, gamepad)
        return
    job_file = Path(what[0])
    check_free(job_file, replace_old)
    _check_terminal()
    named = resolve.named_arm(arm_path)
    with resolve.board(board_options, named) as board:
        arm = resolve.arm_of_board(board, named)
        jog.prepare(board, arm)
        _collect(board, JobPoints(arm, board.posture_deg, job_file), by_hand, gamepad)


def _check_terminal() -> None:
    if not keys.is_terminal():
        raise InputError("teach by keys needs a terminal", "run it in one")


def _own_arm_file(arm_path: Path | None) -> Path:
    """The arm file to write to; raises InputError for a shipped arm."""
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
        f"{joint.name} {angle:.12g}{joint.unit.sign}"
        for joint, angle in zip(arm.driven, angles_deg, strict=True)
    )
    results.echo(f"{file}: posture {name!r}: {words}")


def _collect(board: Board, points: TaughtPoints, by_hand: bool, gamepad: bool) -> None:
    """Collect the points and write them; print them if that fails."""
    try:
        with jog.pressed_keys(board, gamepad) as pressed:
            if by_hand:
                _guide(board, pressed, points)
            else:
                jog.screen(board, pressed, more=points.keys, more_help=_MORE).loop()
        points.save()
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


_BY_HAND_S = 0.3


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
        shown = f"{row(points.where().round(2).tolist())} {points.signs} by the encoders"
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


TAKE, UNDO = "p", "u"


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
        return f"point {len(self.points_deg)} taken: {row(point)}"

    def undo(self) -> str:
        """Remove the last point; returns a message."""
        if not self.points_deg:
            return "there is no point to remove"
        self.points_deg.pop()
        return f"point {len(self.points_deg) + 1} removed"

    def save(self) -> None:
        """Write what they are; raises InputError for too few points."""
        raise NotImplementedError

    @property
    def signs(self) -> str:
        """The units of its positions, for a line of numbers."""
        return ", ".join(dict.fromkeys(joint.unit.sign.strip() for joint in self._arm.driven))

    def tell(self) -> None:
        """Print the points if the file cannot be written, so that they are not lost."""
        for point in self.points_deg:
            click.echo(f"[[via]]\n{self._arm.texts.list_key('angles_deg')} = [{row(point)}]", err=True)


class JobPoints(TaughtPoints):
    """The via points of a new job."""

    def __init__(self, arm: Arm, where: Callable[[], Array], file: Path) -> None:
        super().__init__(arm, where)
        self._file = file

    def save(self) -> None:
        """Write the job; raises InputError for fewer than two points."""
        text = taught.of_points(taught.name_of(self._file), self.points_deg, self._arm)
        replace_text(self._file, text)
        results.echo(
            f"written: {self._file}, {len(self.points_deg)} via points; 'armtempo plan --job {self._file}' plans it"
        )


def postures_deg(arm: Arm, names: Sequence[str], points: Sequence[str]) -> list[list[float]]:
    """The angles, (J,), of the postures of the arm file at ``points``; InputError unless there is one for each."""
    if len(names) != len(points):
        raise InputError(
            f"--at {','.join(names)}: {len(names)} postures", f"give {len(points)}: at {', '.join(points)}"
        )
    return [via_points.posture_deg(arm, arm.posture(name.strip())).tolist() for name in names]


class NamedPoints(TaughtPoints):
    """The points of a frame, or the postures for a tool, which are taken in this order."""

    def __init__(self, arm: Arm, where: Callable[[], Array], new: NewTable) -> None:
        super().__init__(arm, where)
        self._new = new

    def take(self) -> str:
        """Store the arm's position as the next point; returns a message."""
        count, points = len(self.points_deg), self._new.points
        if count == len(points):
            return f"not taken: all {count} are there; q writes the {self._new.kind}, u removes the last"
        said = super().take()
        if len(self.points_deg) == count:
            return said
        try:
            self._new.check(self.points_deg)
        except InputError as error:
            self.points_deg.pop()
            return f"not taken: {error.problem}; {error.hint}"
        then = [*points[1:], f"q writes the {self._new.kind}"][count]
        return f"{points[count]} taken; next: {then}"

    def save(self) -> None:
        """Write what they give; raises InputError if some are missing."""
        points = self._new.points
        if len(self.points_deg) < len(points):
            raise InputError(
                f"{len(self.points_deg)} of {len(points)} points, so no {self._new.kind} was written",
                f"take {', '.join(points)}",
            )
        for line in self._new.save(self.points_deg):
            results.echo(line)


def row(point: Sequence[float]) -> str:
    """A posture as the list in a file has it."""
    return ", ".join(f"{angle + 0.0:.12g}" for angle in point)
