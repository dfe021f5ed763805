"""Exact distances of line segments from boxes and from each other, vectorised."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armtempo.basics.arrays import Array


def box_distance(start: Array, end: Array, low: Sequence[float], high: Sequence[float]) -> Array:
    """Distance of segments (N, 3) to (N, 3) from a box: (N,); negative if it is inside.

    Along a segment the squared distance is convex, and a parabola between its crossings of the planes of the
    faces, so its minimum is at a crossing or an apex. Inside: minus the depth at the deepest of these points.
    """
    segment = end - start
    ends = np.array([low, high], dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossings = (ends[None] - start[:, None]) / segment[:, None]
    crossings = np.where(np.isfinite(crossings), crossings, 0.0).reshape(len(start), 6)
    bounds = np.sort(
        np.clip(np.column_stack([crossings, np.zeros(len(start)), np.ones(len(start))]), 0.0, 1.0)
    )
    middle = 0.5 * (bounds[:, 1:] + bounds[:, :-1])
    points = start[:, None] + middle[:, :, None] * segment[:, None]
    face = np.where(points < ends[0], ends[0], np.where(points > ends[1], ends[1], np.nan))
    outside = np.isfinite(face)
    gap = np.where(outside, start[:, None] - np.where(outside, face, 0.0), 0.0)
    slope = np.where(outside, segment[:, None], 0.0)
    square = np.sum(slope**2, axis=2)
    apex = np.divide(-np.sum(gap * slope, axis=2), square, out=middle.copy(), where=square > 0.0)
    apex = np.clip(apex, bounds[:, :-1], bounds[:, 1:])
    places = np.concatenate([bounds, apex], axis=1)
    points = start[:, None] + places[:, :, None] * segment[:, None]
    beyond = np.maximum(np.maximum(ends[0] - points, points - ends[1]), -np.inf)
    away = np.linalg.norm(np.maximum(beyond, 0.0), axis=2)
    inside = np.minimum(beyond.max(axis=2), 0.0)
    return np.asarray((away + inside).min(axis=1))


def segment_distance(start: Array, end: Array, other_start: Array, other_end: Array) -> Array:
    """Distance between segments, all (N, 3): (N,)."""
    best = np.full(len(start), np.inf)
    segment, other = end - start, other_end - other_start
    gap = start - other_start
    a, b, c = (
        np.sum(one * two, axis=1) for one, two in ((segment, segment), (segment, other), (other, other))
    )
    d, e = np.sum(segment * gap, axis=1), np.sum(other * gap, axis=1)
    determinant = a * c - b * b
    inner = determinant > 1e-12 * np.maximum(a * c, 1e-300)
    s = np.divide(b * e - c * d, determinant, out=np.zeros_like(a), where=inner)
    t = np.divide(a * e - b * d, determinant, out=np.zeros_like(a), where=inner)
    inner &= (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    apart = np.linalg.norm(gap + s[:, None] * segment - t[:, None] * other, axis=1)
    best = np.where(inner, apart, best)
    for point, base, along in (
        (start, other_start, other),
        (end, other_start, other),
        (other_start, start, segment),
        (other_end, start, segment),
    ):
        best = np.minimum(best, point_distance(point, base, along))
    return np.asarray(best)


def point_distance(point: Array, start: Array, segment: Array) -> Array:
    """Distance of points (N, 3) from segments: (N,)."""
    square = np.sum(segment**2, axis=1)
    part = np.sum((point - start) * segment, axis=1)
    part = np.clip(np.divide(part, square, out=np.zeros_like(part), where=square > 0.0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(point - start - part[:, None] * segment, axis=1))
