"""Population searches with one interface, ``minimise``, for any function.

Each algorithm is a module of this package with

- ``PARAMETERS``: its own parameters by name, with their defaults and ranges, and
- ``search(task, *, ...) -> Result``, with the ``Task`` and a value for each of them.
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
"""The module of each algorithm (Table 4) by name."""


@checked_fields
@dataclass(frozen=True)
class Settings:
    """The algorithm, its parameters, population and iterations."""

    algorithm: str = "acs"
    """A key of ALGORITHMS."""
    population: int = 10
    iterations: int = 500
    parameters: Mapping[str, Value] = field(default_factory=dict)
    """Values of the algorithm's own parameters that differ from the defaults."""


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
    """Search the minimum of ``function`` within ``bounds``.

    ``function``: values (N,) of points (N, d), called once for a whole population; NaN counts as infinity.
    ``bounds`` (d, 2): lowest and highest value of each variable. ``progress`` counts iterations. The same state of
    ``rng`` gives the same result. Raises InputError for an unknown algorithm or parameter, a value out of its
    range, a population below 4, no iterations, or bounds that are not pairs (lowest, highest).
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
    """``given``, if each is a known parameter with an allowed value; raises InputError otherwise."""
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
