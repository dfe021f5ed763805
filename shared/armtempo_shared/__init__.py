"""What host and board both need to agree on; runs on CPython and on MicroPython, without numpy."""
