"""Options of several commands, and the object that holds those of the commands for a board."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from armtempo.basics.errors import InputError

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

FC = TypeVar("FC", bound=Callable[..., Any] | click.Command)

PATH = click.Path(path_type=Path)
FILE = click.Path(dir_okay=False, path_type=Path)
FOLDER = click.Path(file_okay=False, path_type=Path)


def not_empty(ctx: click.Context, param: click.Parameter, name: str | None) -> str | None:
    """The name that an option gives; InputError for "", which code takes for none.

    An unset variable of a script would else go unseen.
    """
    if name is not None and not name.strip():
        raise InputError(f"{param.opts[0]}: the name is empty", "give one, or leave the option out")
    return name


class _Finite:
    """Refuses nan and inf."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        found = super().convert(value, param, ctx)  # type: ignore[misc]
        if not math.isfinite(found):
            name = param.opts[0] if param else "number"
            raise InputError(f"{name}: {value} is not a finite number", "give a finite one")
        return found


class FiniteNumber(_Finite, click.types.FloatParamType):
    """A finite number."""


class FiniteRange(_Finite, click.FloatRange):
    """A finite number in a range."""


class TakesNumbers(click.Command):
    """A command whose arguments may begin with a minus sign: "-10,20" is a posture, not an option; "--speed" is one."""

    ignore_unknown_options = True

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The rest of the arguments; UsageError for a word that is neither an option nor a number."""
        rest = super().parse_args(ctx, args)
        for argument in (one for one in self.params if isinstance(one, click.Argument)):
            given = ctx.params[argument.name or ""]
            for text in given if isinstance(given, tuple) else (given,):
                if str(text)[:1] == "-" and str(text)[1:2] not in ".0123456789":
                    ctx.fail(f"No such option {str(text)!r}.")
        return rest


def file(*names: str, **settings: Any) -> Callable[[FC], FC]:
    """An option that takes a FILE."""
    return click.option(*names, type=FILE, metavar="FILE", **settings)


def folder(*names: str, **settings: Any) -> Callable[[FC], FC]:
    """An option that takes a FOLDER."""
    return click.option(*names, type=FOLDER, metavar="FOLDER", **settings)


_ELSE = "Default: variable ARMTEMPO_{}, else the project folder's armtempo.toml"
_ARM = "Arm file (TOML), or the name of a shipped arm, such as ar4"

port = click.option(
    "--port",
    metavar="PORT",
    help="Serial device or URL of the board; 'sim': a virtual board for this command; 'sim:FOLDER': the same with "
    f"its flash in FOLDER. {_ELSE.format('PORT')}, else the only board that is plugged in.",
)
log_traffic = file(
    "--log-traffic",
    help="Write every byte to and from the board to FILE ('armtempo monitor FILE' shows it). An existing FILE is "
    "only replaced if it is such a log.",
)


def files(ctx: click.Context, param: click.Parameter, begun: str) -> list[CompletionItem]:
    """Completion of an argument that may be a file: the shell's own."""
    from click.shell_completion import CompletionItem

    return [CompletionItem(begun, type="file")]


def _arms(ctx: click.Context, param: click.Parameter, begun: str) -> list[CompletionItem]:
    """The shipped arms whose names start with ``begun``; else files."""
    from click.shell_completion import CompletionItem

    from armtempo.model import shipped

    names = [name for name in shipped.files() if name.startswith(begun)]
    return [CompletionItem(name) for name in names] if names and begun else files(ctx, param, begun)


def _arm_option(text: str) -> Callable[[FC], FC]:
    return click.option("--arm", "arm_path", type=PATH, metavar="ARM", help=text, shell_complete=_arms)


arm = _arm_option(f"{_ARM}. {_ELSE.format('ARM')}.")
arm_of_board = _arm_option(
    f"{_ARM}. {_ELSE.format('ARM')}, else the paper's arm if the board is set up for it."
)
arm_of_file = _arm_option(
    f"{_ARM}, which a trajectory file must fit. {_ELSE.format('ARM')}, else the arm in the trajectory file."
)
replace_arm = click.option(
    "--replace-arm",
    is_flag=True,
    help="If the board is set up for another arm, set it up for this one; its position is unknown afterwards.",
)
gamepad = click.option(
    "--gamepad", is_flag=True, help="Use a gamepad in addition to the keys (needs the extra 'gamepad')."
)
frame = click.option(
    "--frame",
    default="base",
    metavar="NAME",
    help="Frame of the arm file in which poses are.  [default: base]",
)
tool = click.option(
    "--tool",
    metavar="NAME",
    callback=not_empty,
    help="Tool of the arm file that is on the arm: poses and axes are of its point.",
)
holds = click.option(
    "--holds",
    metavar="NAME",
    callback=not_empty,
    help="Load of the arm file that the tool holds: it keeps to the workspace, too.",
)
job = click.option(
    "--job",
    "job_path",
    type=PATH,
    metavar="FILE",
    help=f"Job file (TOML). {_ELSE.format('JOB')}.",
)
out = folder(
    "--out",
    help=f"Folder for run folders; each run makes a new one. {_ELSE.format('RUNS')}, else 'runs'.",
)
altered = click.option(
    "--altered",
    is_flag=True,
    help="Accept the trajectory file although it was altered after it had been written.",
)
speed = click.option(
    "--speed",
    "percent",
    type=FiniteRange(1, 100),
    default=100.0,
    show_default=True,
    metavar="PERCENT",
    help="Percentage of the planned speed; the path is the same.",
)
as_json = click.option("--json", "as_json", is_flag=True, help="Print JSON.")


def force(what: str) -> Callable[[FC], FC]:
    """The option --force, which replaces ``what``."""
    return click.option("--force", is_flag=True, help=f"Replace {what}.")


@dataclass(frozen=True)
class BoardOptions:
    """Options of a command for a board; options that the command does not have keep the default."""

    port: str | None = None
    log_traffic: Path | None = None
    as_json: bool = False
    arm_path: Path | None = None
    replace_arm: bool = False
    altered: bool = False


def board(*before: Callable[[Any], Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Options of a command for a board: those of ``before``, --port, --log-traffic and --json.

    The command gets those of ``BoardOptions`` as one argument, ``given``. This must be its innermost
    decorator.
    """
    names = [field.name for field in fields(BoardOptions)]

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def decorated(**values: Any) -> None:
            given = BoardOptions(**{name: values.pop(name) for name in names if name in values})
            command(given=given, **values)

        for option in reversed((*before, port, log_traffic, as_json)):
            option(decorated)
        return decorated

    return decorate
