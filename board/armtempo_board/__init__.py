"""The board program: MicroPython for the STM32F407.

::

    app/       the main loop, the host's commands, events, the start
    link/      frames from and to the serial port
    storage/   records in flash
    motion/    one motion: checked, started, served, stopped
    stepgen/   from splines to the times of steps; integers only, no hardware
    hardware/  timers, DMA, pins, interrupts

Each imports only from those below it, and from the modules next to the packages. The functions here are for
``boot.py``, ``main.py`` and the prompt; the packages do not use them.
"""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from armtempo_board.app.cell import Cell

    cell: Cell
    """That of the user's program that runs."""


def load_program() -> "Any":
    """Import the program, which takes most of the chip's heap; prints a traceback if that fails."""
    import sys

    from armtempo_board import heap

    heap.collect_often()
    if "armtempo_sectors" in sys.modules:
        sys.modules["armtempo_sectors"].load()
    from armtempo_board.app import program

    return program


def start() -> None:
    """Run the program until a host asks for the prompt; after an exception the traceback waits for that too."""
    program = load_program()
    try:
        program.main()
    except Exception:
        from armtempo_board import prompt

        prompt.wait()
        raise


def keep_watchdog_fed() -> None:
    """Feed a watchdog that was started before a soft reset."""
    from armtempo_board.app import watchdog

    if watchdog.running():
        watchdog.keep_fed()


def replay(name: str = "") -> None:
    """Run a stored motion (default: the default motion) without a host; see ``app/standalone.py``."""
    load_program()
    try:
        import armtempo_sectors  # noqa: F401  finds more modules
    except ImportError:  # they are elsewhere
        pass
    from armtempo_board.app import standalone

    standalone.replay(name)
