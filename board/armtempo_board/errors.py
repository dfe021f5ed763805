"""The exception by which a command is refused."""

from armtempo_shared.messages import NO_JOINT


class Refused(Exception):
    """A refusal: ``code`` of ``armtempo_shared.codes``, the joint (or NO_JOINT) and a value."""

    def __init__(self, code: int, joint: int = NO_JOINT, value: int = 0) -> None:
        super().__init__(code)
        self.code = code
        self.joint = joint
        self.value = value
