"""The exception by which a command is refused, and the names of its codes."""

from armtempo_shared import codes
from armtempo_shared.messages import NO_JOINT


class Refused(Exception):
    """A refusal: ``code`` of ``armtempo_shared.codes``, the joint (or NO_JOINT) and a value."""

    def __init__(self, code: int, joint: int = NO_JOINT, value: int = 0) -> None:
        super().__init__(code)
        self.code = code
        self.joint = joint
        self.value = value


def name_of(code: int) -> str:
    """Name of a refusal or fault, from ``codes``."""
    for name in dir(codes):
        if getattr(codes, name) == code:
            return name.lower()
    return ""
