"""Polynomials on [0, 1] in scaled Bernstein form: products are convolutions, and coefficients are bounds.

A polynomial of degree k is stored in the last axis of an array as b_i * C(k, i), i = 0..k, with its Bernstein
coefficients b; functions accept any number of leading axes.
"""

from __future__ import annotations

from functools import cache
from math import comb

import numpy as np

from armtempo.splines.bspline import Array


def from_power(coefficients: Array) -> Array:
    """Scaled Bernstein form of power coefficients (..., k + 1)."""
    return np.asarray(coefficients @ _power_map(coefficients.shape[-1] - 1))


@cache
def _power_map(degree: int) -> Array:
    """u^j as sum over i of C(degree - j, i - j) times the scaled basis functions."""
    return np.array(
        [[comb(degree - j, i - j) if i >= j else 0 for i in range(degree + 1)] for j in range(degree + 1)],
        dtype=float,
    )


def multiply(first: Array, second: Array) -> Array:
    """Product, of degree k + l, of (..., k + 1) and (..., l + 1)."""
    count = first.shape[-1]
    shape = np.broadcast_shapes(first.shape[:-1], second.shape[:-1])
    product = np.zeros((*shape, count + second.shape[-1] - 1))
    for i in range(second.shape[-1]):
        product[..., i : i + count] += first * second[..., i : i + 1]
    return product


def elevate(polynomial: Array, degree: int) -> Array:
    """The same polynomial with a higher ``degree``."""
    return np.asarray(polynomial @ _elevation(polynomial.shape[-1] - 1, degree))


@cache
def _elevation(degree: int, higher: int) -> Array:
    ones = np.array([comb(higher - degree, i) for i in range(higher - degree + 1)], dtype=float)
    return multiply(np.eye(degree + 1), ones)


def derivative(polynomial: Array) -> Array:
    """Derivative, of degree k - 1."""
    degree = polynomial.shape[-1] - 1
    plain = np.diff(unscale(polynomial), axis=-1) * degree
    return np.asarray(plain * _binomials(degree - 1))


def unscale(polynomial: Array) -> Array:
    """Plain Bernstein coefficients: their smallest and largest bound the polynomial on [0, 1]."""
    return np.asarray(polynomial / _binomials(polynomial.shape[-1] - 1))


@cache
def _binomials(degree: int) -> Array:
    return np.array([comb(degree, i) for i in range(degree + 1)], dtype=float)


def halves(plain: Array) -> Array:
    """Plain coefficients of both halves, each over [0, 1]: (..., 2, k + 1)."""
    degree = plain.shape[-1] - 1
    return np.asarray((plain @ _halving(degree)).reshape(*plain.shape[:-1], 2, degree + 1))


@cache
def _halving(degree: int) -> Array:
    """De Casteljau's subdivision at the midpoint as a matrix (k + 1, 2 k + 2)."""
    matrix = np.zeros((degree + 1, 2, degree + 1))
    for row in range(degree + 1):
        for column in range(row + 1):
            matrix[column, 0, row] = comb(row, column) / 2.0**row
            matrix[degree - column, 1, degree - row] = comb(row, column) / 2.0**row
    return matrix.reshape(degree + 1, -1)
