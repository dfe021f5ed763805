"""The one board of this process and what hangs on it; ``setup.power_up`` puts them here."""

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
