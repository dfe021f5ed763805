"""Lévy flights: the random steps of the cuckoo searches, many small ones and a few huge ones."""

from __future__ import annotations

import math

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.optimise.parameters import Number

BETA = Number(1.5, 0.3, 1.99, "index of the Lévy distribution, Eq. (23)")
"""The index of the distribution, in the range that Mantegna gives for his method (Physical Review E 49 (5),
1994, pp. 4677-4683)."""


def levy_steps(rng: np.random.Generator, shape: tuple[int, ...], beta: float) -> Array:
    """Symmetric Lévy-stable steps of index ``beta``, within BETA, by Mantegna's method, Eq. (23)."""
    steps: Array = levy_scale(beta) * rng.standard_normal(shape)
    steps /= np.abs(rng.standard_normal(shape)) ** (1.0 / beta)
    return steps


def levy_scale(beta: float) -> float:
    """The factor of Gamma functions in Eq. (23), with its brackets set as in its source (Mantegna)."""
    top = math.gamma(1.0 + beta) * math.sin(math.pi * beta / 2.0)
    bottom = math.gamma((1.0 + beta) / 2.0) * beta * 2.0 ** ((beta - 1.0) / 2.0)
    return float((top / bottom) ** (1.0 / beta))
