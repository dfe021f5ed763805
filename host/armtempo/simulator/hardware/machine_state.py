"""The one virtual board of this process and what is connected to it, as ``setup.power_up`` made them."""

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
