"""Basis matrices of the uniform B-spline, Eq. (15) of the paper, in exact integers.

``BASIS[k][j][i]`` is the factor of control point ``i`` in the coefficient of ``u**j``,
times ``k!``; ``FACTORIAL[k]`` is that ``k!``.
"""

FACTORIAL = {3: 6, 5: 120}

BASIS = {
    3: (
        (1, 4, 1, 0),
        (-3, 0, 3, 0),
        (3, -6, 3, 0),
        (-1, 3, -3, 1),
    ),
    5: (
        (1, 26, 66, 26, 1, 0),
        (-5, -50, 0, 50, 5, 0),
        (10, 20, -60, 20, 10, 0),
        (-10, 20, 0, -20, 10, 0),
        (5, -20, 30, -20, 5, 0),
        (-1, 5, -10, 10, -5, 1),
    ),
}
