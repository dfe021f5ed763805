"""Whether the drivers are off: ENABLE against its level in the arm record."""


def measure(record):
    """``record``: file of the arm record. ``noted``: what the previous part stored."""
    active = None
    joints = []
    try:
        with open(record, "rb") as file:
            data = file.read()
        from armtempo_shared import armrecord

        head, joints, _ = armrecord.unpack(data)
        active = 1 if head["flags"] & armrecord.FLAG_ENABLE_HIGH else 0
    except (OSError, ValueError):
        pass  # no arm
    output, driven, level = enable()
    return {
        "active": active,
        "output": output,
        "driven": driven,
        "level": level,
        "joints": joints,
        "noted": noted,
    }
