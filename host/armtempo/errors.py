"""What can go wrong, as one tree of exceptions.

::

    ArmtempoError                exit code 1 unless a subclass says otherwise
    ├── InputError               the user's file, option or argument is wrong (exit code 2)
    ├── PlanError                no plan under these limits, or no posture for this pose
    ├── MissingPackageError      an optional package is not installed
    ├── RunFolderError           a recorded run cannot be read, is not whole, or cannot be written
    └── LinkError                the board cannot be reached or stopped answering
        └── BoardError           the board answered, and refused; carries its code

Every message says what is wrong, where, and what to do.
"""

from __future__ import annotations

INTERRUPTED = 130
"""Exit code of the command after Ctrl-C."""


class ArmtempoError(Exception):
    """Base of all errors that are shown to the user as one message, without a traceback."""

    exit_code = 1


class InputError(ArmtempoError):
    """A file, option or argument from the user is wrong."""

    exit_code = 2


class PlanError(ArmtempoError):
    """The input is well formed but has no solution, and the message says why."""


class MissingPackageError(ArmtempoError):
    """An optional package is needed for this and is not installed."""


class RunFolderError(ArmtempoError):
    """A run folder is incomplete, contradicts itself, or cannot be written."""


class LinkError(ArmtempoError):
    """No board, no answer, or the connection broke."""


class BoardError(LinkError):
    """The board refused a command or reported a fault.

    ``code`` is the number from ``armtempo_shared.wire.ERRORS``.
    """

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code
