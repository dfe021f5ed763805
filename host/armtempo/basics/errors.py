"""The tree of exceptions.

::

    ArmtempoError                  exit code 1 unless a subclass says otherwise
    ├── InputError                 the user's file, option or argument is wrong (exit code 2)
    ├── PlanError                  no plan under these limits, or no posture for this pose
    ├── MissingPackageError        an optional package is not installed
    ├── ToolError                  a program of the system that armtempo calls is missing or fails
    ├── RunFolderError             a recorded run cannot be read, is incomplete, or cannot be written
    └── LinkError                  the board cannot be reached or stopped answering
        ├── PortError              the port exists but cannot be opened
        │   └── PortInUseError     another program has it
        ├── PortGivenUpError       the program that had the port has closed it
        ├── NoAnswerError          the port is open and the board does not answer in time
        ├── NoProgramError         MicroPython's prompt answers instead of the board program
        ├── DisturbedError         parts of messages arrive, but too few complete ones
        ├── OtherBoardError        another board answers than before, or it has restarted
        ├── BoardError             the board refused a command or a fault ended a motion; carries the code
        ├── PartError              a part of the self-test raised an exception on the board
        └── SilentError            the board does not answer in a part of the self-test

Every error says what is wrong and where (``problem``) and what to do next (``hint``). Stopped is not in the
tree: it is a KeyboardInterrupt, raised after a stop request brought a motion to rest.
"""

from __future__ import annotations

INTERRUPTED = 130
"""Exit code of the command after Ctrl-C."""


class ArmtempoError(Exception):
    """Base of all errors that are shown to the user without a traceback.

    ``problem`` says what is wrong and where; ``hint`` what to do about it, as a clause without a full stop.
    """

    exit_code = 1

    def __init__(self, problem: str, hint: str = "") -> None:
        super().__init__(problem, hint)
        self.problem = problem
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.problem}; {self.hint}" if self.hint else self.problem


class InputError(ArmtempoError):
    """A file, option or argument from the user is wrong."""

    exit_code = 2


class PlanError(ArmtempoError):
    """The input is valid but has no solution; the message says why."""


class MissingPackageError(ArmtempoError):
    """``what`` needs an optional ``package`` that is not installed; ``extra`` is armtempo's extra that installs it."""

    def __init__(self, what: str, package: str, extra: str) -> None:
        # imported here, as a stop from a second program imports this module
        from armtempo.basics import installation

        super().__init__(
            f"{what} needs {package}, which is not installed",
            f"install it with: {installation.command(package, extra)}",
        )


class ToolError(ArmtempoError):
    """A program of the system is not installed, or failed."""


class RunFolderError(ArmtempoError):
    """A run folder is incomplete or inconsistent, or cannot be written."""


class LinkError(ArmtempoError):
    """There is no board, it does not answer, or the connection broke."""


class PortError(LinkError):
    """The port exists but cannot be opened."""


class PortInUseError(PortError):
    """Another program has the port."""


class PortGivenUpError(LinkError):
    """The program that had the port has closed it or ended."""


class NoAnswerError(LinkError):
    """The board did not answer a command in time."""


class NoProgramError(LinkError):
    """MicroPython's prompt answers: the board program is not installed or does not run."""


class DisturbedError(LinkError):
    """Parts of messages arrive, but too few complete ones: worth another try."""


class OtherBoardError(LinkError):
    """Another board answers than before, or the board has restarted."""


class BoardError(LinkError):
    """The board refused a command or reported a fault.

    ``code`` is the number from ``armtempo_shared.codes``.
    """

    def __init__(self, problem: str, hint: str, code: int) -> None:
        super().__init__(problem, hint)
        self.code = code
