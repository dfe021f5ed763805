"""``armtempo jog``: move a joint, or the tool along or about an axis, by keys or by a given amount."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from armtempo.basics.errors import ArmtempoError, InputError, LinkError
from armtempo.cli import gamepad, keys, options, posture, resolve, results
from armtempo.cli.jog_screen import KEYS, SPEEDS, JogScreen
from armtempo.cli.keys import Keys
from armtempo.cli.options import BoardOptions
from armtempo.model.arm import Arm
from armtempo.model.frame import TOOL
from armtempo.model.tool_pose import BASE
from armtempo.planning.jog.jog_line import axis_of
from armtempo.planning.jog.jog_motion import by_of_joint, number_of_joint
from armtempo.ports.names import is_sim
from armtempo.robot.board import Board

_AXES = click.Choice(["x", "y", "z", "tool-x", "tool-y", "tool-z"])


@click.command("jog")
@click.option(
    "--joint",
    metavar="JOINT",
    help="Move this joint, by its number (from 1) or name, by --by degrees, or mm if it slides.",
)
@click.option("--axis", type=_AXES, help="Move the tool along this axis by --by mm.")
@click.option("--about", type=_AXES, help="Turn the tool about this axis by --by degrees.")
@click.option(
    "--frame",
    metavar="NAME",
    help="Frame whose axes are meant: one of the arm file, or 'tool'.  [default: base]",
)
@click.option("--by", type=options.FiniteNumber(), metavar="NUMBER", help="Distance: degrees or mm.")
@click.option(
    "--to",
    type=options.FiniteNumber(),
    metavar="NUMBER",
    help="With --joint, where to move it, in its unit, instead of --by.",
)
@click.option(
    "--speed",
    type=options.FiniteRange(1, 100),
    default=25,
    show_default=True,
    help="Percent of the speed limits.",
)
@options.tool
@options.holds
@options.gamepad
@options.board(options.arm_of_board, options.replace_arm)
def jog(
    joint: str | None,
    axis: str | None,
    about: str | None,
    frame: str | None,
    by: float | None,
    to: float | None,
    speed: float,
    tool: str | None,
    holds: str | None,
    gamepad: bool,
    given: BoardOptions,
) -> None:
    """Move a joint or the tool by a step, or while a key is held.

    Without --joint, --axis and --about, keys move the arm, and one line shows the position. With one of them
    and --by, the arm moves once. Axes are those of the base, of the tool at its present orientation (tool-x, …)
    or of a --frame of the arm file. The arm must be homed. Ctrl-C brakes.
    """
    if to is not None and (joint is None or by is not None):
        raise InputError("--to needs --joint, without --by", "for example --joint 2 --to 30")
    moves = _one_move(joint, axis, about, by if to is None else to, gamepad, given.as_json)
    chosen = axis or about
    if frame is not None and (joint is not None or "-" in (chosen or "")):
        raise InputError("--frame says whose x, y or z is meant", "for example --frame tray --axis x --by 10")
    arm = resolve.named_arm(given.arm_path)
    if arm is not None:  # what is wrong is reported before a port is opened
        arm.with_tool(tool).holding(holds).frame(BASE if frame in (None, TOOL) else frame)
        if joint is not None:
            number_of_joint(arm, joint)
    with resolve.board(given, arm) as board:
        prepare(board, resolve.arm_of_board(board, arm).with_tool(tool).holding(holds), given.replace_arm)
        made_for = board.arm
        assert made_for is not None  # set by ``prepare``
        if not moves:
            with pressed_keys(board, gamepad) as pressed:
                made = screen(board, pressed, speed)
                made.choice.choose(frame or BASE)
                made.loop()
        elif joint is not None and to is not None:
            to_deg, to_mm = by_of_joint(made_for, joint, to)
            board.jog_to(joint, to_deg, speed / 100, position_mm=to_mm)
        else:
            named = axis_of(frame, chosen) if frame and chosen else chosen
            by_deg, by_mm = (None, by) if axis else (by, None)
            if joint is not None and by is not None:
                by_deg, by_mm = by_of_joint(made_for, joint, by)
            board.jog(joint, by_deg, named, by_mm, speed / 100)
        early = board.last_jog_ends
        if not (early and given.as_json):
            posture.print_position(board, given.as_json)
        if early:
            raise ArmtempoError(f"the jog ended early: {early}", "jog less far, or the other way")


def _one_move(
    joint: str | None, axis: str | None, about: str | None, by: float | None, gamepad: bool, as_json: bool
) -> bool:
    """Whether the options ask for a single move instead of the keys; raises InputError if they contradict."""
    moves = sum(option is not None for option in (joint, axis, about))
    if moves > 1 or (by is None) != (not moves):
        raise InputError(
            "--by needs one of --joint, --axis and --about, and they need --by",
            "for example --joint 2 --by -5; or none of them, for the keys",
        )
    if moves and gamepad:
        raise InputError("--gamepad is for jog by keys", "leave out --by, or --gamepad")
    if not moves and as_json:
        raise InputError(
            "--json is not possible with jog by keys", "give --joint, --axis or --about, and --by"
        )
    if not moves and not keys.is_terminal():
        raise InputError("jog by keys needs a terminal", "give --joint, --axis or --about, and --by")
    return moves == 1


def prepare(board: Board, arm: Arm, replace_arm: bool = False) -> None:
    """Set the board up; raises LinkError if the position is unknown. A new virtual arm is at home."""
    board.configure(arm, replace=replace_arm)
    try:
        board.posture_deg()
    except LinkError:
        if not is_sim(board.port):
            raise
        board.home(arm)


@contextmanager
def pressed_keys(board: Board, with_gamepad: bool) -> Iterator[Keys]:
    """The keys of the terminal, and of a gamepad if ``with_gamepad``."""
    assert board.arm is not None  # set by ``configure``
    with keys.of_terminal() as pressed:
        if not with_gamepad:
            yield pressed
            return
        with gamepad.added_to(pressed, len(board.arm.driven)) as both:
            results.echo(gamepad.HELP)
            yield both


def screen(
    board: Board,
    pressed: Keys,
    speed: float = 25,
    more: dict[str, Callable[[], str]] | None = None,
    more_help: str = "",
) -> JogScreen:
    """The jog screen, after printing its keys; ``more``: keys of the caller, described by ``more_help``."""
    results.echo(f"{KEYS}\n{more_help}" if more_help else KEYS)
    made = JogScreen(board, pressed, more, more_help)
    made.choice.speed = min(range(len(SPEEDS)), key=lambda index: abs(SPEEDS[index] - speed))
    return made
