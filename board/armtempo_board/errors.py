"""The exception by which a command is refused."""

from armtempo_shared.messages import NO_JOINT


class Refused(Exception):
    """``code`` of ``armtempo_shared.codes``, the joint that it is about (NO_JOINT: none) and a value."""

    def __init__(self, code: int, joint: int = NO_JOINT, value: int = 0) -> None:
        super().__init__(code)
        self.code = code
        self.joint = joint
        self.value = value
