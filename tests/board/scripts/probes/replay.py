"""armtempo_board.replay() as typed at the REPL: replay.py FLASH NAME."""

import sys

import bare_board

bare_board.start(flash=sys.argv[1], program=sys.path[:])

import setup  # noqa: E402
from armtempo_board.hardware import pins  # noqa: E402

setup.connect(pins)
import armtempo_board  # noqa: E402

armtempo_board.replay(sys.argv[2])
armtempo_board.replay(sys.argv[2])
armtempo_board.replay("nothing")
