"""The ``armtempo`` command, also as ``python -m armtempo``: Ctrl-C ends it quietly before much is imported."""

from __future__ import annotations

import _signal  # built in; during the long import of ``signal`` a Ctrl-C would print a traceback
import os
import sys

from armtempo.basics.errors import INTERRUPTED


def _end(*signalled: object) -> None:
    """Exit at once: nothing is open yet, and an import may swallow an exception."""
    os.write(2, b"armtempo: interrupted\n")
    os._exit(INTERRUPTED)


def main() -> None:
    """Run the command; ``armtempo.cli`` handles Ctrl-C once a subcommand begins."""
    # It may be ignored, in the background
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
        _signal.signal(_signal.SIGINT, _end)
    if sys.argv[1:2] == ["stop"]:
        from armtempo.ports import quick_stop

        quick_stop.send(sys.argv[2:])
    from armtempo.cli import main as command

    command(prog_name="armtempo")


if __name__ == "__main__":
    main()
