"""The highest step rates that the board allows and reports: the defaults, or those measured by its self-test."""

from armtempo_shared.limits import MAX_STEP_RATE, MAX_STEP_RATE_SUM

one = MAX_STEP_RATE
together = MAX_STEP_RATE_SUM
joints = 0
"""Number of joints in the measurement; 0: the rates are estimates."""
