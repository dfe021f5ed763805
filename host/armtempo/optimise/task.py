"""Common parts of the searches: task, parameters, result; counting evaluations and tracking the best point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.progress import Progress

Value = float | str
Function = Callable[[Array], Array]
"""Values (N,) of points (N, d)."""


@dataclass(frozen=True)
class Number:
    """A parameter from ``least`` to ``most``; an integer if the default is an int."""

    default: float
    least: float
    most: float
    meaning: str

    @property
    def allowed(self) -> str:
        """Text: the range."""
        kind = "a whole number" if isinstance(self.default, int) else "a number"
        return f"{kind} from {self.least:g} to {self.most:g}"

    def admits(self, value: object) -> bool:
        """Whether ``value`` has the right type and is in the range."""
        if isinstance(value, bool) or not isinstance(
            value, int if isinstance(self.default, int) else int | float
        ):
            return False
        return self.least <= value <= self.most


@dataclass(frozen=True)
class OneOf:
    """A parameter with one of several words."""

    default: str
    words: tuple[str, ...]
    meaning: str

    @property
    def allowed(self) -> str:
        """Text: the words."""
        return "one of " + ", ".join(repr(word) for word in self.words)

    def admits(self, value: object) -> bool:
        """Whether ``value`` is one of the words."""
        return value in self.words


Parameter = Number | OneOf


@dataclass(frozen=True, eq=False)
class Task:
    """A task for a search: function, bounds, population, iterations."""

    function: Function
    bounds: Array
    """(d, 2): lowest and highest value of each variable."""
    rng: np.random.Generator
    population: int
    iterations: int
    progress: Progress | None = None


@dataclass(frozen=True)
class Result:
    """Result of a search: best point ``x`` (d,), its ``value``, number of evaluations.

    ``history`` (iterations + 1,): the best value after the first population and after each iteration.
    """

    x: Array
    value: float
    evaluations: int
    history: Array


class Tracker:
    """Evaluates points for a search, counts them, and stores the best.

    A search calls ``evaluate`` for every population, ``iteration_done`` after the first population and after each
    iteration, and ``result`` at the end.
    """

    def __init__(self, task: Task) -> None:
        self._task = task
        self._history: list[float] = []
        self._x: Array = np.empty(0)
        self.value = float("inf")
        """Best value so far."""
        self.evaluations = 0

    @property
    def x(self) -> Array:
        """Best point so far, (d,)."""
        return self._x

    def evaluate(self, points: Array) -> Array:
        """Values (N,) of ``points`` (N, d); infinity instead of NaN."""
        values = self._task.function(points)
        self.evaluations += len(points)
        if np.isnan(values.min(initial=np.inf)):
            values = np.where(np.isnan(values), np.inf, values)
        best = int(values.argmin())
        if values[best] < self.value or not self._x.size:
            self.value = float(values[best])
            self._x = points[best].copy()
        return values

    def iteration_done(self) -> None:
        """End the first population (first call) or an iteration (later calls)."""
        self._history.append(self.value)
        if self._task.progress is not None and len(self._history) > 1:
            self._task.progress(len(self._history) - 1, self._task.iterations)

    def result(self) -> Result:
        """The best point, with the history."""
        return Result(self._x, self.value, self.evaluations, np.array(self._history))
