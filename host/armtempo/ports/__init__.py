"""Serial ports: names, list, default, and sharing: one program owns a port, others use it through that program.

::

    names.py      names of ports
    board_port.py  the ports of this machine, and which is meant if none is given
    claim.py      the file that says which program has a port and where that program listens
    line_socket.py  lines over a socket, and requests as lines, with few imports
    messages.py   messages over a socket, one line of JSON each; the requests and their fields
    server.py     the owner's end: answers requests, publishes samples and events
    caller.py     the other end: finds the owner, asks, subscribes
    quick_stop.py  the beginning of ``armtempo stop``, which asks it before the rest is imported

The messages: host/docs/sharing.md.
"""
