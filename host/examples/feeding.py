"""The paper's feeding motion: planned, replayed three times, reported.

Usage: python feeding.py [PORT]; without a port on a virtual board.
"""

import sys

import armtempo

port = sys.argv[1] if len(sys.argv) > 1 else "sim"
arm = armtempo.Arm.paper()
plan = armtempo.plan(arm, armtempo.Job.paper())
print("\n".join(armtempo.summary(plan)))
with armtempo.connect(port, arm) as board:
    board.home(arm)  # the arm is in its home posture: look before you say so
    board.goto(plan)
    run = board.run(plan, repeat=3)
print(run.report())
