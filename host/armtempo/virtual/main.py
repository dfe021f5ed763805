"""The virtual board's process: ``main.py OPTIONS.json``, under MicroPython or CPython.

Puts the simulated hardware in place of ``pyb``, ``machine``, ``stm``, ``time``, ``os``, … and runs the board
program on it, again after each reset. The serial port is stdin and stdout; the options are described in
``options.py``.
"""

import json
import sys

HERE = sys.argv[0].rsplit("/", 1)[0]


def prepare(options):
    """Make the simulated modules importable; returns the simulator's ``session`` module."""
    sys.path.insert(0, HERE + "/hardware")
    if sys.implementation.name != "micropython":
        sys.path.insert(0, HERE + "/cpython")
        import additions  # noqa: F401
    from simulator import modules, session

    modules.replace()
    sys.path.append(options["flash"])
    sys.path.append(options["flash"] + "/lib")
    sys.path.extend(options["program"])
    return session


def main():
    """Run until the launcher goes."""
    with open(sys.argv[1]) as file:
        options = json.load(file)
    prepare(options).run(options)


main()
