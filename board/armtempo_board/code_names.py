"""Names of refusals and faults, for texts; loaded where they are needed, as the codes take more than a kilobyte."""

from armtempo_shared import codes


def name_of(code: int) -> str:
    """Name of a refusal or fault, from ``codes``."""
    for name in dir(codes):
        if getattr(codes, name) == code:
            return name.lower()
    return ""
