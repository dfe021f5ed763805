"""The one virtual board of this process, what is connected to it (made by ``setup.power_up``), and what ends it."""

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
    """The processor starts again; ``cause`` as ``machine.reset_cause()`` will say it."""

    def __init__(self, cause):
        super().__init__(cause)
        self.cause = cause


class PowerOff(BaseException):
    """The virtual board ends because its launcher has ended."""
