"""EXTI's software trigger (RM0090 12.3.5): a bit that is set asks for the line's interrupt."""

from chip import memory

_SWIER = 4  # word of EXTI


def sync(board):
    """EXTI was written."""
    at = memory.index("EXTI") + _SWIER
    asked = memory.words[at]
    if asked:
        memory.poke(at, 0)  # as the handler's clearing of the pending bit does
        for line, extint in board.extints.items():
            if asked >> line & 1 and extint.enabled:
                board.pend("exti", line)
