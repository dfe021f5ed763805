"""The board program: MicroPython for the STM32F407.

::

    app/       the main loop, what the host's commands do, what the board tells, the start
    link/      frames from and to the serial port
    storage/   records in flash
    motion/    one motion: checked, started, served, stopped
    stepgen/   from splines to the times of steps; integers only, no hardware
    hardware/  timers, DMA, pins, interrupts

Each imports only from those below it, and from the modules next to the packages. The functions here are for
``boot.py``, ``main.py`` and the prompt; nothing in the packages uses them.
"""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


def load_program() -> "Any":
    """Import the program, which takes most of the chip's heap; where that fails, the traceback says why."""
    from armtempo_board import heap

    heap.collect_often()
    from armtempo_board.app import program

    return program


def start() -> None:
    """Run the program until a host asks for the prompt; where it ends by itself the traceback waits for that too."""
    program = load_program()
    try:
        program.main()
    except Exception:
        from armtempo_board import prompt

        prompt.wait()
        raise


def keep_watchdog_fed() -> None:
    """Feed a watchdog that runs since before a soft reset, as nothing else does now."""
    from armtempo_board.app import watchdog

    if watchdog.running():
        watchdog.keep_fed()


def replay(name: str = "") -> None:
    """Run a stored motion without a host, the default where no name is given; see ``app/standalone.py``."""
    from armtempo_board.app import standalone

    standalone.replay(name)
