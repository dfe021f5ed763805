"""Pallets in a user's program (``cell.py``); loaded by the first one."""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


class Place:
    """A place of a pallet, or what is ``above`` it, for ``Cell.goto``."""

    def __init__(self, name: str, steps: "list[int]", above: "Place | None" = None) -> None:
        self.name = name
        self.steps = steps
        self.above = above or self

    def __str__(self) -> str:
        return self.name


class Pallet:
    """The places of a pallet: by columns, then rows, then layers. ``cell``: a ``Cell``; ``work``: its ``Work``.

    Where it is kept through the ends of programs, until it is full, begun again, or the board loses its memory.
    """

    def __init__(self, cell: "Any", work: "Any", name: str, shape: "list[Any]") -> None:
        self._cell = cell
        self._work = work
        self._name = name
        self._rows, self._columns, self._layers, self._firsts = shape
        self._key = (name, self._rows, self._columns, self._layers)
        self._taken = work.taken(self._key)
        if self._taken:
            cell.say("pallet %r goes on at %s" % (name, self._place_name()))

    def left(self) -> int:
        """Number of places that ``next`` has not given yet."""
        return int(self._rows * self._columns * self._layers - self._taken)

    def next(self) -> Place:
        """The next place, for ``goto``, and with ``.above`` what is above it; Error if none is left."""
        if self.left() <= 0:
            raise self._cell.Error("pallet %r has no place left; reset() begins again" % self._name)
        tool = self._cell.tool_name
        if tool not in self._firsts:
            raise self._cell.Error(
                "pallet %r cannot be reached with tool %r" % (self._name, tool or "nothing")
            )
        found = list(self._work.place(self._firsts[tool] + self._taken))
        joints = len(found) // 2
        name = "%s of pallet %r" % (self._place_name(), self._name)
        self._take(self._taken + 1)
        return Place(name, found[joints:], Place("above " + name, found[:joints]))

    def reset(self, taken: int = 0) -> None:
        """Begin again at the first place, or behind the first ``taken`` ones."""
        if not 0 <= taken <= self._rows * self._columns * self._layers:
            raise self._cell.Error("pallet %r has no %r places" % (self._name, taken))
        self._take(taken)

    def _take(self, taken: int) -> None:
        self._taken = taken
        self._work.note_taken(self._key, taken if self.left() else 0)  # the next program has another one

    def _place_name(self) -> str:
        """Of the next place."""
        rest, column = divmod(self._taken, self._columns)
        layer, row = divmod(rest, self._rows)
        return "row %d, column %d, layer %d" % (row + 1, column + 1, layer + 1)
