"""Adaptive cuckoo search: budget, both variants, and its quality on the paper's joints."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo import optimise
from armtempo.basics.errors import InputError
from armtempo.planning.fitness import Fitness

from tests.host import problems

FEEDING = problems.load()[0]
VARIANTS = ("differences", "paper")


def fitness_of(joint: int) -> Fitness:
    """Fitness of one joint of the paper's motion."""
    from armtempo.splines import bspline

    points = bspline.fit(np.array(FEEDING.job.via), 5)
    limits = FEEDING.arm.driven[joint].limits
    assert limits is not None
    return Fitness(points[:, [joint]], 5, [limits])


@pytest.mark.slow
@pytest.mark.parametrize("joint", range(3))
def test_is_near_the_best_known_with_every_seed(joint: int) -> None:
    """A part of host/docs/acs.md: median within 0.05 %, worst within 0.3 %, at most 2 N 500 evaluations."""
    function = fitness_of(joint).stretched
    excess = []
    for seed in range(12):
        found = optimise.minimise(function, [(0.1, 3.0)] * 6, np.random.default_rng(seed))
        assert found.evaluations <= 2 * 10 * 500
        excess.append(100 * (found.value / FEEDING.best_s[joint] - 1))
    assert np.median(excess) <= 0.05, f"seeds 0 to 11: {excess}"
    assert max(excess) <= 0.3, f"seeds 0 to 11: {excess}"


@pytest.mark.parametrize("variant", VARIANTS)
def test_finds_a_narrow_valley(variant: str) -> None:
    def valley(x: np.ndarray) -> np.ndarray:
        return np.asarray(100 * (x[:, 1] - x[:, 0] ** 2) ** 2 + (1 - x[:, 0]) ** 2)

    settings = optimise.Settings("acs", 10, 400, {"variant": variant})
    found = optimise.minimise(valley, [(-2, 2)] * 2, np.random.default_rng(1), settings)
    assert found.value < {"differences": 1e-6, "paper": 1e-2}[variant]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"variant": "other"}, "'other'"),
        ({"pa": 0.0}, "pa"),
        ({"beta": 2.5}, "beta"),
        ({"alpha": 1}, "'alpha'"),
    ],
)
def test_refuses_other_parameters(parameters: dict[str, object], message: str) -> None:
    settings = optimise.Settings("acs", 10, 5, parameters)
    with pytest.raises(InputError, match=message):
        optimise.minimise(lambda x: x.sum(1), [(0, 1)], np.random.default_rng(1), settings)
