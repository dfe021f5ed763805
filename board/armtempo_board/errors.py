"""The exception by which a command is refused."""


class Refused(Exception):
    """``code`` of ``armtempo_shared.codes``, the joint that it is about (255: none) and a value."""

    def __init__(self, code: int, joint: int = 255, value: int = 0) -> None:
        super().__init__(code)
        self.code = code
        self.joint = joint
        self.value = value
