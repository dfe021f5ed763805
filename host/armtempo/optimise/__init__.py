"""Population searches behind one interface: ``minimise``. Nothing in here knows of robots or time.

Each algorithm is a module of this package with

- ``PARAMETERS``: its own parameters by name, with their defaults (number, string or bool), and
- ``search(function, bounds, rng, population, iterations, progress, **parameters) -> Result``.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from armtempo.errors import InputError
from armtempo.optimise.tracker import Array, Function, Progress, Result, Tracker

__all__ = ["ALGORITHMS", "Function", "Progress", "Result", "Tracker", "defaults", "minimise"]

ALGORITHMS = {
    "acs": "armtempo.optimise.acs",
    "cs": "armtempo.optimise.cs",
    "ga": "armtempo.optimise.ga",
    "hpso": "armtempo.optimise.hpso",
    "iaga": "armtempo.optimise.iaga",
    "pso": "armtempo.optimise.pso",
}
"""Name of an algorithm: the module that holds it."""


def defaults(algorithm: str) -> Mapping[str, float | str | bool]:
    """The parameters of an algorithm and their defaults. Raises InputError for an unknown name."""
    parameters: Mapping[str, float | str | bool] = _module(algorithm).PARAMETERS
    return parameters


def minimise(
    function: Function,
    bounds: ArrayLike,
    rng: np.random.Generator,
    population: int,
    iterations: int,
    algorithm: str = "acs",
    progress: Progress | None = None,
    **parameters: float | str | bool,
) -> Result:
    """Smallest value of ``function`` found inside ``bounds``.

    ``function`` takes points (N, d) and returns their values (N,), one call for a whole population;
    a value that is not a number counts as infinitely bad. ``bounds`` is (d, 2): lowest and highest
    value of each variable. ``progress(done, iterations)`` is called after each iteration. The same
    ``rng`` state gives the same result. Raises InputError for an unknown algorithm or parameter, a
    population below 4, no iterations, or bounds that leave no room.
    """
    module = _module(algorithm)
    box = _checked_bounds(bounds)
    if population < 4 or iterations < 1:
        raise InputError(
            f"optimiser: population {population} must be at least 4, iterations {iterations} at least 1"
        )
    known = _checked_parameters(algorithm, module.PARAMETERS, parameters)
    result: Result = module.search(function, box, rng, population, iterations, progress, **known)
    return result


def _module(algorithm: str) -> ModuleType:
    if algorithm not in ALGORITHMS:
        raise InputError(f"optimiser {algorithm!r} is not known; there are {', '.join(sorted(ALGORITHMS))}")
    return import_module(ALGORITHMS[algorithm])


def _checked_bounds(bounds: ArrayLike) -> Array:
    box = np.array(bounds, dtype=float)
    if box.ndim != 2 or box.shape[1] != 2 or not np.all(np.isfinite(box)) or np.any(box[:, 0] > box[:, 1]):
        raise InputError("optimiser: bounds must be finite pairs (lowest, highest), one for each variable")
    return box


def _checked_parameters(
    algorithm: str, known: Mapping[str, float | str | bool], given: Mapping[str, float | str | bool]
) -> dict[str, float | str | bool]:
    """``known`` with the ``given`` values put in; each must be of its default's kind."""
    for name, value in given.items():
        if name not in known:
            raise InputError(
                f"optimiser {algorithm!r} has no parameter {name!r}; "
                f"it has {', '.join(sorted(known)) or 'none'}"
            )
        if not _same_kind(known[name], value):
            raise InputError(
                f"optimiser {algorithm!r}: {name} = {value!r} must be of the kind of {known[name]!r}"
            )
    return {**known, **given}


def _same_kind(default: float | str | bool, value: float | str | bool) -> bool:
    if isinstance(default, (bool, str)):
        return type(value) is type(default)
    return isinstance(value, (int, float)) and not isinstance(value, bool) and bool(np.isfinite(value))
