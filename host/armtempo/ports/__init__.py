"""Serial ports: their names, which exist, which is meant, and one writer with many readers for each.

::

    names.py, listing.py  what a port is called, and which ports this machine has
    board_port.py  which of them is meant if none is given
    claim.py      the file that says which program has a port and where that program listens
    lines.py      messages over a socket, a line of JSON each
    requests.py   what may be asked for, with which fields
    server.py     the owner's end: requests in, samples and events out
    caller.py     the other end: who has this port, ask it, subscribe
    quick_stop.py  the beginning of ``armtempo stop``, which asks it before the rest is imported

The messages: host/docs/sharing.md.
"""
