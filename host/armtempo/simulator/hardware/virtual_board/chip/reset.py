"""Leaving the program: resets of every kind."""


class Reset(BaseException):
    """The processor starts again; ``cause`` as ``machine.reset_cause()`` will say it."""

    def __init__(self, cause):
        super().__init__(cause)
        self.cause = cause


class PowerOff(BaseException):
    """The virtual board is to end: its launcher has gone."""
