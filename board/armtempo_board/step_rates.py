"""The highest step rates that the board allows and states: of any board, or as its self-test measured them."""

from armtempo_shared.limits import MAX_STEP_RATE, MAX_STEP_RATE_SUM

one = MAX_STEP_RATE
together = MAX_STEP_RATE_SUM
joints = 0
"""Of how many joints they were measured; 0: they are estimated."""
