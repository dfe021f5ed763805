"""One writer, many readers: the program that has a port answers others on this machine over a local socket.

::

    claim.py      the file that says who has a port and where that program listens
    lines.py      messages over a socket, a line of JSON each
    server.py     the owner's end: requests in, samples and events out
    caller.py     the other end: who has this port, ask it, subscribe

What is said there: host/docs/sharing.md. Nothing here knows what a board is.
"""
