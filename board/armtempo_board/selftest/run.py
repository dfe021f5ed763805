"""Runs a part of the self-test at the prompt, and prints its result as JSON for the host."""

import gc
import json
import sys

from armtempo_board.selftest import common

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_PACKAGE = "armtempo_board.selftest"


def run(number: int, part: str, arguments: "dict[str, Any]") -> None:
    """Run ``measure`` of a module of this package, and forget them all: a program that continues has its heap.

    ``number``: of the part, from 1, stored over a reset. The result has what was stored before as ``noted``: the
    number of a part that hung, else 0.
    """
    noted = common.note(number)
    try:
        module = __import__(_PACKAGE + "." + part, None, None, ("measure",))
        found = module.measure(**arguments)
        found["noted"] = noted
        print(json.dumps(found))
    finally:
        common.note(0)
        _forget()


def _forget() -> None:
    for name in list(sys.modules):
        if name.startswith(_PACKAGE):
            del sys.modules[name]
    package = sys.modules["armtempo_board"]
    if hasattr(package, "selftest"):
        del package.selftest
    gc.collect()
