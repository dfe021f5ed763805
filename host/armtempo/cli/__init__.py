"""The ``armtempo`` command: its subcommands are imported only when one is used."""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import FrameType
from typing import Any

import click
from click.shell_completion import CompletionItem

from armtempo.basics.errors import INTERRUPTED, ArmtempoError
from armtempo.basics.installation import installed_version
from armtempo.basics.text import did_you_mean
from armtempo.cli import results
from armtempo.cli.commands import COMMANDS, GROUPS

_EXAMPLES = """\
Examples:

\b
  armtempo demo                        the paper's motion on a virtual board
  armtempo new my_arm                  make a folder for your arm; run the commands below in it
  armtempo plan                        plan a job, write a trajectory file
  armtempo run first.json --repeat 3   replay and record it
  armtempo COMMAND --help              more about one of them
"""


_AS_JSON = "armtempo.as_json"
"""Key of click's context: whether the command line has ``--json``."""
_AGAIN_S = 0.01
_MOST_WAITS = 300
"""Longer than any import takes; a command that is run while importing is interrupted all the same."""


class LazyGroup(click.Group):
    """A group that imports a command's module when it is asked for it."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All names, in the order of the table."""
        return [*COMMANDS]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The commands with what they do, group by group."""
        width = formatter.width - 6 - max(map(len, COMMANDS))
        for title, entries in GROUPS.items():
            with formatter.section(title):
                rows = [(name, one.short_help(width)) for name, one in entries.items()]
                formatter.write_dl(rows)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Commands whose names start with ``incomplete``, with their short help; then click's own
        completions."""
        found = [
            CompletionItem(name, help=one.short_help())
            for name, one in COMMANDS.items()
            if name.startswith(incomplete)
        ]
        return [*found, *click.Command.shell_complete(self, ctx, incomplete)]

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """The command of that name."""
        if name not in COMMANDS:
            return None
        entry = COMMANDS[name]
        command: click.Command = getattr(import_module(f"{__name__}.{entry.module}"), entry.function)
        command.epilog = entry.epilog
        for parameter in command.params:
            if isinstance(parameter, click.Option) and isinstance(
                parameter.type, click.IntRange | click.FloatRange
            ):
                parameter.metavar = parameter.metavar or "NUMBER"
        return command

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Note whether JSON is asked for: a failure is a document then, too."""
        ctx.meta[_AS_JSON] = "--json" in args
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command in ``args``; the error for an unknown command names the most similar one."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            near = did_you_mean(args[0], COMMANDS) or ". 'armtempo --help' lists them"
            ctx.fail(f"no command {args[0]!r}{near}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; an error that the user can correct is one message, without a traceback."""
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")  # the code page may lack a character
        as_json = ctx.meta[_AS_JSON]
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads make work on matrices this small slower
        try:
            with raised_by_signals():
                return super().invoke(ctx)
        except click.UsageError as error:
            (error.ctx or ctx).fail(results.fitted(error.format_message(), "Error: "))
        except ArmtempoError as error:
            results.show_error(error, as_json=as_json)
            ctx.exit(error.exit_code)
        except OSError as error:
            if error.errno == errno.EPIPE:  # the reader of the output has closed it: click ends quietly
                raise
            results.show_error(_of_file(error), as_json=as_json)
            ctx.exit(1)
        except MemoryError as error:
            results.show_error(
                ArmtempoError(
                    f"not enough memory: {error}".rstrip(": "),
                    "close other programs, or lower refine or the population",
                ),
                as_json=as_json,
            )
            ctx.exit(1)
        except KeyboardInterrupt as error:
            results.echo(f"armtempo: interrupted{': ' if error.args else ''}{error}", err=True)
            ctx.exit(INTERRUPTED)


@contextmanager
def raised_by_signals() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM raise KeyboardInterrupt.

    If Ctrl-C is ignored, as in a program that a shell runs in the background, it stays ignored.
    """
    ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    numbers = [signal.SIGTERM] if ignored else [signal.SIGTERM, signal.SIGINT]
    numbers += [signal.SIGALRM] if hasattr(signal, "setitimer") else []
    handler = _Interrupt()
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        waiting = hasattr(signal, "setitimer") and signal.setitimer(signal.ITIMER_REAL, 0.0)[0] > 0.0
        for number, earlier in before.items():
            signal.signal(number, earlier)
        if waiting:
            raise KeyboardInterrupt


class _Interrupt:
    """Raises KeyboardInterrupt; during an import, where compiled modules may swallow it, SIGALRM tries again."""

    def __init__(self) -> None:
        self._waits = 0

    def __call__(self, number: int, frame: FrameType | None) -> None:
        if hasattr(signal, "setitimer") and self._waits < _MOST_WAITS and _importing(frame):
            self._waits += 1
            signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        else:
            raise KeyboardInterrupt


def _importing(frame: FrameType | None) -> bool:
    while frame and not frame.f_code.co_filename.startswith("<frozen importlib"):
        frame = frame.f_back
    return frame is not None


def _of_file(error: OSError) -> ArmtempoError:
    """The operating system's reason for an error with a file, and what to check."""
    where = f"{error.filename}: " if error.filename else ""
    return ArmtempoError(
        f"{where}{error.strerror or error}", "check the path, its permissions and the space on the disk"
    )


def _show_version(context: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    """Look it up only if it is asked for: every command would wait for it."""
    if wanted:
        results.echo(f"armtempo, version {installed_version()}")
        context.exit()


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]}, epilog=_EXAMPLES)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version and exit.",
)
@click.option("-q", "--quiet", is_flag=True, help="No progress bars and no remarks: only results and errors.")
def main(quiet: bool) -> None:
    """Time-optimal B-spline motions for stepper arms, replayed by an STM32F407 with MicroPython."""
