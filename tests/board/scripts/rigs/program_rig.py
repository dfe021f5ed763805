"""Users' programs on the program above the engine, with stand-ins for the engine and the time."""

import sys

import stand_in
from app_rig import connected
from armtempo_shared import program, sequence, wire
from sequence_rig import ARM_CRC, LEGS, Inputs, Outputs

if sys.implementation.name == "cpython":
    import traceback

    sys.print_exception = lambda error, file: traceback.print_exception(error, file=file)
HEAD = "from armtempo_board import cell\n"
TABLE = {
    "file": "pick.py",
    "limits": [[1000, 4000, 20000], [1000, 4000, 20000]],
    "per_deg": [10.0, 20.0],
    "postures": {"home": [0, 0], "there": [10, 10], "away": [10, 100000]},
    "motions": {},
    "outputs": {"gripper": [1, 0.0, 1.0, {"open": 0, "closed": 65535}]},
    "inputs": {"part": 0},
    "counters": ["parts"],
    "pallets": {"tray": [2, 1, 2, {"": 0, "long": 4}], "far": [1, 1, 1, {"long": 8}]},
    "tools": {"long": {"there": [12, 12], "away": []}},
}
PLACES = [[10 * number, 20, 10 * number + 1, 21] for number in range(9)]


class World:
    """What goes on around a program: ``script`` is called with it in each pass of the loop."""

    def __init__(self, source, script=lambda world: None, legs=LEGS, **more):
        self.app, self.host = connected()
        self.controller = self.app.controller
        self.board = self.controller.board
        self.board.outputs, self.board.inputs = Outputs(), Inputs()
        self.script = script
        self.turns = 0
        for name in sorted(legs):
            assert self.host.upload(name, legs[name])[-1][0] == "ok"
        table = dict(TABLE, **more)
        table["motions"] = {name: wire.record_crc(legs[name]) for name in legs}
        self.data = program.pack(ARM_CRC, table, HEAD + source, PLACES)

    def start(self):
        """Store it and start it: the answer."""
        assert self.host.upload("pick", self.data)[-1][0] == "ok"
        return self.start_stored()

    def start_stored(self):
        return self.host.ask("start", (0, wire.record_crc(self.data)), "pick")

    def count_syncs(self):
        """Whether the arm moves in each sync of the flash from now on, after ``start``."""
        synced = []

        class Os:
            def sync(_):
                synced.append(self.board.engine.moving)

        sys.modules["armtempo_board.app.user_program"].os = Os()
        return synced

    def execute(self):
        """As the main loop does."""
        self.app.execute_program(self.turn)
        self.host.turn(5)

    def run(self):
        answer = self.start()
        assert answer[0] == "ok", answer
        self.execute()
        return self.stands()

    def turn(self):
        self.turns += 1
        assert self.turns < 20000, "it does not end"
        stand_in.Clock.now_ms += 1
        self.script(self)
        self.host.turn()

    def stands(self):
        kind, fields, name = self.host.ask("sequence")
        assert kind == "ok" and name in ("pick.py", b"pick.py"), name
        return sequence.ENDINGS[fields[0]], fields[1], fields[2]

    def said(self):
        return [tail for kind, _, tail in self.host.events if kind == "notice"]

    def target(self):
        """Where the move in memory ends, steps."""
        move = self.board.once.motion(self.board.store)
        points = [move.points(move.angle_offset(joint) + 8 * move.segments, 5) for joint in range(2)]
        weights = (1, 26, 66, 26, 1)
        sums = [sum([weight * point for weight, point in zip(weights, row)]) for row in points]
        return [(one + (60 << 28)) // (120 << 28) for one in sums]
