"""The ``armtempo`` command, also as ``python -m armtempo``: Ctrl-C ends it quietly before much is imported."""

from __future__ import annotations

import _signal  # built in; ``signal`` imports much, in which a Ctrl-C would be a traceback
import os
import sys

from armtempo.basics.errors import INTERRUPTED


def _end(*signalled: object) -> None:
    """At once: nothing is open yet, and what is being imported may swallow an exception."""
    os.write(2, b"armtempo: interrupted\n")
    os._exit(INTERRUPTED)


def main() -> None:
    """The command; ``armtempo.cli`` takes Ctrl-C over when a subcommand begins."""
    if (
        _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler
    ):  # it may be ignored, in the background
        _signal.signal(_signal.SIGINT, _end)
    if sys.argv[1:2] == ["stop"]:
        from armtempo.ports import quick_stop

        quick_stop.send(sys.argv[2:])
    from armtempo.cli import main as command

    command(prog_name="armtempo")


if __name__ == "__main__":
    main()
