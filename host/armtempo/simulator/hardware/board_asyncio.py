"""In the place of ``asyncio``, whose tasks would wait for times of another clock: not for virtual time."""


def __getattr__(name):
    raise ImportError("asyncio does not run on a virtual board, as its clock is in real time")
