"""Exceptions that end the program: resets and power-off."""


class Reset(BaseException):
    """The processor starts again; ``cause`` as ``machine.reset_cause()`` will say it."""

    def __init__(self, cause):
        super().__init__(cause)
        self.cause = cause


class PowerOff(BaseException):
    """The virtual board ends because its launcher has ended."""
