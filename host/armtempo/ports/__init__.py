"""Serial ports: their names, which exist, which is meant, and one writer with many readers for each.

::

    names.py      what a port is called
    board_port.py  which ports this machine has, and which is meant if none is given
    claim.py      the file that says which program has a port and where that program listens
    messages.py   messages over a socket, a line of JSON each; what may be asked for, with which fields
    server.py     the owner's end: requests in, samples and events out
    caller.py     the other end: who has this port, ask it, subscribe
    quick_stop.py  the beginning of ``armtempo stop``, which asks it before the rest is imported

The messages: host/docs/sharing.md.
"""
