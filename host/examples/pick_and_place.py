"""Pick and place both ways: a stored sequence, which needs no host while it runs, and a script that decides as it goes.

Usage: python pick_and_place.py [PORT]; without a port on a virtual board, which has no part sensor to wait for.
"""

import sys
from pathlib import Path

import armtempo

PARTS = 2
STEPS = """
name = "two-parts"
start = "home"

[posture.feeder]
angles_deg = [0, -50, 30]

[posture.tray]
angles_deg = [20, -55, 35]

[[step]]
repeat = 2

[[step]]
goto = "feeder"

[[step]]
output = "gripper"
to = "closed"
wait_s = 0.2

[[step]]
goto = "tray"

[[step]]
output = "gripper"
to = "open"
wait_s = 0.2

[[step]]
end = "repeat"

[[step]]
goto = "home"
"""

port = sys.argv[1] if len(sys.argv) > 1 else "sim"
arm = armtempo.Arm.load(Path(armtempo.__file__).parent / "data" / "pick_and_place" / "arm.toml")
Path("two-parts.toml").write_text(STEPS, encoding="utf-8")
sequence = armtempo.plan_sequence(arm, armtempo.Sequence.load("two-parts.toml", arm))
feeder, tray = [0, -50, 30], [20, -55, 35]
to_tray = armtempo.plan(arm, armtempo.Job("to-tray", via_deg=[feeder, tray], refine=16))

with armtempo.connect(port, arm) as board:
    board.home(arm)
    end = board.run_sequence(sequence)  # the board does all of it by itself
    print("sequence:", end.ending, "after", end.cycle, "parts")

    gripper = board.output("gripper")  # the same, with a decision after each part
    for part in range(PARTS):
        board.goto(feeder)
        gripper.set("closed")
        board.run(to_tray)
        gripper.set("open")
        print("part", part + 1, "lies on the tray")
    board.goto(arm.home_deg)
