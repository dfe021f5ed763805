"""Eq. (15) turned into Bezier points: the weight of each control point in each of them. Needed once a degree."""

from armtempo_shared.basis import BASIS, FACTORIAL

_DEGREE = 5  # of the Bezier points
_DIVISOR = 120  # weights are times 120, so that all are whole
_BINOMIAL = (
    (1, 0, 0, 0, 0, 0),
    (1, 1, 0, 0, 0, 0),
    (1, 2, 1, 0, 0, 0),
    (1, 3, 3, 1, 0, 0),
    (1, 4, 6, 4, 1, 0),
    (1, 5, 10, 10, 5, 1),
)


def table(degree: int) -> bytes:
    """Weights of the control points in each of six Bezier points of degree 5, times 120.

    A power coefficient a_j adds C(i, j) / C(5, j) a_j to Bezier point i. First byte: number of control points.
    """
    found = bytearray([degree + 1])
    for point in range(_DEGREE + 1):
        for control in range(degree + 1):
            total = 0
            for power in range(degree + 1):
                factor = _DIVISOR // FACTORIAL[degree] * BASIS[degree][power][control]
                total += _BINOMIAL[point][power] * factor // _BINOMIAL[_DEGREE][power]
            found.append(total)
    return bytes(found)
