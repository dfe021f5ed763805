"""The exception by which a command is refused."""


class Refused(Exception):
    """``code`` of ``armtempo_shared.codes``, the joint that it is about (255: none) and a value."""

    def __init__(self, code, joint=255, value=0):
        super().__init__(code)
        self.code = code
        self.joint = joint
        self.value = value
