"""This process's virtual board and what is connected to it (set by ``setup.power_up``), and its ends."""

board = None
pace = None
serial = None
port = None
flash = None
edges = None
arm = None
pins = None
options = {}
settings = {}


class Reset(BaseException):
    """A reset; ``cause``: for ``machine.reset_cause()``."""

    def __init__(self, cause):
        super().__init__(cause)
        self.cause = cause


class PowerOff(BaseException):
    """The launcher has ended."""
