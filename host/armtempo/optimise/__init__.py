"""Population searches with one interface: ``minimise``. Nothing in here knows of robots or time.

Each algorithm is a module of this package with

- ``PARAMETERS``: its own parameters by name, each with its default and what it may be, and
- ``search(task, *, ...) -> Result``, which takes the ``Task`` and a value for each of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from armtempo.basics.arguments import checked, checked_fields
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.basics.progress import Progress
from armtempo.optimise.task import Function, Parameter, Result, Task, Value

__all__ = ["ALGORITHMS", "Function", "Result", "Settings", "minimise", "parameters"]

ALGORITHMS = {
    "acs": "armtempo.optimise.acs",
    "cs": "armtempo.optimise.cs",
    "ga": "armtempo.optimise.ga",
    "iaga": "armtempo.optimise.iaga",
    "pso": "armtempo.optimise.pso",
    "hpso": "armtempo.optimise.hpso",
}
"""Name of an algorithm (Table 4): the module that holds it."""


@checked_fields
@dataclass(frozen=True)
class Settings:
    """Which search looks for the smallest value, and how long."""

    algorithm: str = "acs"
    """A key of ALGORITHMS."""
    population: int = 10
    iterations: int = 500
    parameters: Mapping[str, Value] = field(default_factory=dict)
    """The algorithm's own parameters that are not to have their defaults."""


@checked
def parameters(algorithm: str) -> Mapping[str, Parameter]:
    """The parameters of an algorithm by name. Raises InputError for an unknown algorithm."""
    known: Mapping[str, Parameter] = _module(algorithm).PARAMETERS
    return known


@checked
def minimise(
    function: Function,
    bounds: ArrayLike,
    rng: np.random.Generator,
    settings: Settings | None = None,
    progress: Progress | None = None,
) -> Result:
    """Smallest value of ``function`` found inside ``bounds``.

    ``function`` takes points (N, d) and returns their values (N,), one call for a whole population;
    a value that is not a number counts as infinitely bad. ``bounds`` is (d, 2): lowest and highest
    value of each variable. ``progress`` counts iterations. The same ``rng`` state gives the same result. Raises
    InputError for an unknown algorithm or parameter, a value out of its range, a population below 4, no
    iterations, or bounds that are not pairs (lowest, highest).
    """
    wanted = settings or Settings()
    known = parameters(wanted.algorithm)
    box = _checked_bounds(bounds)
    if wanted.population < 4 or wanted.iterations < 1:
        raise InputError(
            f"optimiser: population {wanted.population}, iterations {wanted.iterations} are too few",
            "give a population of at least 4 and at least 1 iteration",
        )
    values = {name: parameter.default for name, parameter in known.items()}
    values |= _checked(wanted.algorithm, known, wanted.parameters)
    task = Task(function, box, rng, wanted.population, wanted.iterations, progress)
    result: Result = _module(wanted.algorithm).search(task, **values)
    return result


def _module(algorithm: str) -> ModuleType:
    if algorithm not in ALGORITHMS:
        raise InputError(
            f"optimiser {algorithm!r} is not known",
            f"choose one of {', '.join(sorted(ALGORITHMS))}",
        )
    return import_module(ALGORITHMS[algorithm])


def _checked_bounds(bounds: ArrayLike) -> Array:
    box = np.array(bounds, dtype=float)
    if box.ndim != 2 or box.shape[1] != 2 or not np.all(np.isfinite(box)) or np.any(box[:, 0] > box[:, 1]):
        raise InputError(
            "optimiser: the bounds are not finite pairs, lowest before highest",
            "give (lowest, highest) for each variable",
        )
    return box


def _checked(
    algorithm: str, known: Mapping[str, Parameter], given: Mapping[str, Value]
) -> Mapping[str, Value]:
    """``given``, each a known parameter with a value that it admits."""
    for name, value in given.items():
        if name not in known:
            raise InputError(
                f"optimiser {algorithm!r} has no parameter {name!r}",
                f"it has {', '.join(sorted(known))}",
            )
        if not known[name].admits(value):
            raise InputError(
                f"optimiser {algorithm!r}: {name} = {value!r} is not allowed",
                f"give {known[name].allowed}",
            )
    return given
