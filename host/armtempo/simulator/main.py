"""The virtual board's process: ``main.py OPTIONS.json``, under MicroPython or CPython.

Replaces ``pyb``, ``machine``, ``stm``, ``time``, ``os``, … by the simulated hardware and runs the board program
on it, again after each reset. The serial port is stdin and stdout; for the options see ``launch_options.py``.
"""

import json
import sys

HERE = sys.argv[0].rsplit("/", 1)[0]


def prepare():
    """Make the simulated modules importable; returns the module ``power_cycles``, and their folders."""
    folders = [HERE + "/hardware"]
    if sys.implementation.name != "micropython":
        folders.append(HERE + "/cpython")
    path = list(sys.path)
    sys.path[0:0] = folders
    if sys.implementation.name != "micropython":
        import additions  # noqa: F401
    import power_cycles
    from firmware import builtin_modules

    builtin_modules.replace()
    builtin_modules.replace_sys()
    sys.path[:] = path
    return power_cycles, folders


def main():
    """Run until the launcher ends."""
    with open(sys.argv[1]) as file:
        options = json.load(file)
    power_cycles, folders = prepare()
    power_cycles.run(options, folders)


main()
