"""Putting the board program on a board, with mpremote, and taking it off again.

::

    remote.py     mpremote as a process; firmware and files of the board (``survey``)
    program_files.py  the files that the board needs, as sources or compiled
    changes.py    how the two differ, and whether the board is suitable
    install.py    the steps from one to the other
    sectors.py    the compiled program, for the chip's last two sectors of flash
    firmware/     MicroPython firmwares that have the program in them
"""

from armtempo.deploy.install import deploy, undeploy

__all__ = ["deploy", "undeploy"]
