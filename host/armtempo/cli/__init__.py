"""The ``armtempo`` command: its subcommands are imported only when one is used."""

from __future__ import annotations

import errno
import io
import os
import sys
from importlib import import_module
from keyword import iskeyword
from typing import Any

import click

from armtempo.basics.errors import INTERRUPTED, ArmtempoError
from armtempo.basics.version import installed_version
from armtempo.cli import examples, messages
from armtempo.cli.interrupts import raised_by_signals
from armtempo.formats.spelling import did_you_mean

GROUPS = {
    "Plan": ("new", "plan", "ik", "fk", "check", "import", "export", "import-urdf"),
    "Run": (
        "demo",
        "home",
        "goto",
        "jog",
        "teach",
        "run",
        "speed",
        "pause",
        "resume",
        "output",
        "input",
        "stop",
        "clear",
        "status",
        "watch",
        "fetch",
        "report",
        "panel",
    ),
    "Board": (
        *("ports", "deploy", "undeploy", "firmware", "flash", "selftest", "configure"),
        *("upload", "list", "show", "remove", "rename"),
        *("virtual-board", "monitor", "config", "doctor", "help"),
    ),
    "Develop": ("paper", "completion"),
}
"""Commands in the order of the help page. Each is ``command`` in its module: '-' as '_', a keyword with '_' behind."""
COMMANDS = tuple(name for names in GROUPS.values() for name in names)

_EXAMPLES = """\
Examples:

\b
  armtempo demo                        the paper's motion on a virtual board
  armtempo new my_arm                  a folder for an own arm; the commands below are for inside
  armtempo plan                        a job as a trajectory file
  armtempo run first.json --repeat 3   replay and record it
  armtempo COMMAND --help              more about one of them
"""


class LazyGroup(click.Group):
    """A group that imports a command's module when it is asked for it."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """All names, in the order of the table."""
        return [*COMMANDS]  # "list" may be the module of that command here

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The commands with what they do, group by group."""
        width = formatter.width - 6 - max(map(len, COMMANDS))
        for title, names in GROUPS.items():
            with formatter.section(title):
                commands = [(name, self.get_command(ctx, name)) for name in names]
                formatter.write_dl(
                    [(name, command.get_short_help_str(width)) for name, command in commands if command]
                )

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        """The command of that name."""
        if name not in COMMANDS:
            return None
        module = import_module(f"{__name__}.{name.replace('-', '_')}{'_' * iskeyword(name)}")
        command: click.Command = module.command
        command.epilog = examples.of(name)
        for parameter in command.params:
            if isinstance(parameter, click.Option) and isinstance(
                parameter.type, click.IntRange | click.FloatRange
            ):
                parameter.metavar = parameter.metavar or "NUMBER"
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that is meant; the error for one that there is not names the nearest."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            near = did_you_mean(args[0], COMMANDS) or ". 'armtempo --help' lists them"
            ctx.fail(f"no command {args[0]!r}{near}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; an error that the user can correct is one message, without a traceback."""
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="replace")  # a ² in a code page that has none ends no command
        as_json = "--json" in [*ctx._protected_args, *ctx.args]
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads only cost time on matrices this small
        try:
            with raised_by_signals():
                return super().invoke(ctx)
        except ArmtempoError as error:
            messages.show(error, as_json=as_json)
            ctx.exit(error.exit_code)
        except OSError as error:
            if error.errno == errno.EPIPE:  # whoever read the output has gone: click ends quietly
                raise
            messages.show(_of_file(error), as_json=as_json)
            ctx.exit(1)
        except MemoryError as error:
            messages.show(
                ArmtempoError(
                    f"this takes more memory than there is: {error}".rstrip(": "),
                    "close other programs, or ask for less: lower refine, a smaller population",
                ),
                as_json=as_json,
            )
            ctx.exit(1)
        except KeyboardInterrupt as error:
            click.echo(f"armtempo: interrupted{': ' if error.args else ''}{error}", err=True)
            ctx.exit(INTERRUPTED)


def _of_file(error: OSError) -> ArmtempoError:
    """The operating system's reason for an error with a file, and what to check."""
    where = f"{error.filename}: " if error.filename else ""
    return ArmtempoError(
        f"{where}{error.strerror or error}", "check the path, its permissions and the room on the disk"
    )


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]}, epilog=_EXAMPLES)
@click.version_option(installed_version(), prog_name="armtempo")
@click.option("-q", "--quiet", is_flag=True, help="No progress bars and no remarks: only results and errors.")
def main(quiet: bool) -> None:
    """Time-optimal B-spline motions for stepper arms, replayed by an STM32F407 with MicroPython."""
