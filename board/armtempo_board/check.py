"""Is a motion fit to be run? Judged by the board itself before each start."""


def check(motion, joints):
    """None, or (code, joint, value) of the first thing wrong."""
    return None
