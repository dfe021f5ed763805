"""Arm records for tests of the engine."""

HEAD = {"flags": 0, "identity": 0, "pulse_ticks": 168, "low_ticks": 168, "dir_setup_ticks": 420}
HEAD.update(dir_hold_ticks=420, link_timeout_ms=1000)
JOINT = {"channel": 0, "dir_inverted": 0, "encoder": 255, "encoder_inverted": 0, "counts_num": 5}
JOINT.update(counts_den=16, min_steps=-1000000, max_steps=1000000, max_rate=333000, following_counts=20)
JOINT.update(limit_low=255, limit_high=255, limit_active_high=0, spare=0)


def row(**values):
    """A joint of the arm record, with these fields changed."""
    joint = dict(JOINT)
    joint.update(values)
    return joint


def arm(count):
    """Joints on channels 0, 1, …; every other one inverted; encoders on the first four."""
    return [
        row(channel=n, dir_inverted=n & 1, encoder=n if n < 4 else 255, encoder_inverted=n >> 1 & 1)
        for n in range(count)
    ]
