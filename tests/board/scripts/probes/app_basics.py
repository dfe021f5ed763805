"""First words, configuring, uploading, homing, a run with its samples, stopping."""

import sys

import stand_in

stand_in.install()

from armtempo_board.app.app import App  # noqa: E402

port = stand_in.Port()
app = App(port, sys.argv[1])
host = stand_in.Host(app, port)
print(host.ask("status"))
answer = host.hello()
print(answer[0], answer[1][:4], answer[2][:7])
print(host.upload("/arm", stand_in.arm()))
print(host.ask("status"))
motion = stand_in.record(stand_in.arm())
print(host.upload("feed", motion))
print(host.ask("list", (0,)))
print(host.ask("list", (1,)))
print(host.ask("start", (0, stand_in.wire.record_crc(motion)), "feed"))
print(host.ask("home", (3,), bytes(8)))
print(host.ask("status"))
print(host.ask("start", (0, 5), "feed"))
print(host.ask("start", (0, stand_in.wire.record_crc(motion)), "feed"))
app.controller.board.engine.advance(3)
print(host.ask("put_begin", (10, 0), "x"))
print(host.ask("samples", (2, 0)))
app.controller.board.engine.advance(1)
app.controller.board.engine.finish()
print(host.ask("status"))
for event in host.events:
    print(event)
