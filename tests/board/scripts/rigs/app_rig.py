"""What the scripts of cases of the program above the engine share: a board that is ready."""

import sys

import stand_in

stand_in.install()

from armtempo_board.app.app import App  # noqa: E402
from armtempo_shared import wire  # noqa: E402

ROOT = sys.argv[1]
COUNT = [0]


def flash():
    """Folder of the store that ``connected`` made last."""
    return ROOT + str(COUNT[0])


def connected(flags=0, homed=True, fault=0, outputs=(), inputs=()):
    """A configured board with "feed" stored, greeted, and its host."""
    COUNT[0] += 1
    port = stand_in.Port()
    app = App(port, flash(), 0, fault)
    host = stand_in.Host(app, port)
    assert host.hello()[0] == "ok"
    arm = stand_in.arm(flags=flags, outputs=outputs, inputs=inputs)
    assert host.upload("/arm", arm)[-1][0] == "ok"
    host.record = stand_in.record(arm)
    assert host.upload("feed", host.record)[-1][0] == "ok"
    if homed:
        assert host.ask("home", (3,), bytes(8))[0] == "ok"
    return app, host


def start(host):
    return host.ask("start", (0, wire.record_crc(host.record)), "feed")


def state(host):
    return wire.STATES[host.ask("status")[1][0]]


def samples_of(host):
    return [fields[1] for kind, fields, _ in host.events if kind == "sample"]


def ends_of(host):
    return [(kind, fields) for kind, fields, _ in host.events if kind != "sample"]
