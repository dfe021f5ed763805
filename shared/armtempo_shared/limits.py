"""Limits of the board: clock, sampling, step rates, sizes."""

TICK_HZ = 84_000_000
"""Timer ticks per second: TIM2 and TIM5 unscaled (RM0090, APB1 timer clock at 168 MHz core)."""

TICK_FRACTION_BITS = 16
"""Fraction bits of time control points on the wire (ticks / 2**16)."""

STEP_FRACTION_BITS = 28
"""Fraction bits of angle control points on the wire (steps / 2**28)."""

SAMPLE_TICKS = TICK_HZ // 10
"""Ticks between two samples: 0.1 s exactly."""

HOLD_TIMEOUT_MS = 300
"""A held motion brakes after this time without a ``hold`` of the host."""

LONGEST_TICKS = 1 << 38
"""Bound of time control points, almost an hour: in units of 1024 ticks they are small integers of MicroPython."""
LONGEST_RUN_TICKS = 1 << 39
"""A run at a lower speed, with its pauses, lasts at most 1 h 49 min."""
LONGEST_SPAN_TICKS = 1 << 36
"""Bound of the differences of a segment's time control points."""

MOST_STEPS = 1 << 27
"""Bound of angle control points."""
MOST_SPAN_STEPS = 1 << 24
"""Bound of the differences of a segment's angle control points."""

MAX_JOINTS = 6
MAX_ENCODERS = 4
MAX_OUTPUTS = 8
MAX_INPUTS = 8
FULL_OUTPUT = 65535
"""Value of an output at the upper end of its range; 0 is the lower end."""
MAX_SEGMENTS = 512
"""Most time-axis segments in one motion record."""

MAX_NAME = 24
"""Longest name of a stored trajectory, in bytes; letters, digits, '-', '_'."""

MAX_STEP_RATE = 240_000
"""Highest step rate of one joint, steps/s: limited by the main loop, not by the evaluator alone.

Measured on the emulated chip at 3 cycles an instruction, with one, two and three joints: board/docs/evaluator.md.
"""

MAX_STEP_RATE_SUM = 240_000
"""Highest sum of the step rates of all joints, steps/s. The same."""

MAX_BACKLASH_STEPS = 32_767
"""Most steps of a motor that cross the play of its gear."""
MAX_CROSSING_RATE = 10_000
"""Highest step rate of a joint while it crosses its backlash, steps/s: 120 steps are computed ahead, 12 ms."""

REVERSAL_SLACK_TICKS = 8400
"""How late the board may change DIR, before and after the time at which it should: 100 us."""

MAX_MOTION_BYTES = 16384
"""Largest motion record of the board, which must fit into its memory."""
