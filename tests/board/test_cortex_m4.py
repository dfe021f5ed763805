"""What a step costs on the chip must not grow: the benchmark's figures against those stored with it.

If it has to: ``python tests/benchmark/cortex_m4.py --store``.
"""

from __future__ import annotations

import json

import pytest

from tests import interpreters, slack

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("cortex_m4")]

BENCHMARK = interpreters.ROOT / "tests" / "benchmark" / "cortex_m4.py"


@pytest.fixture(scope="module")
def figures() -> dict[str, dict[str, float]]:
    """Measured now."""
    found: dict[str, dict[str, float]] = json.loads(interpreters.run("cpython", BENCHMARK, "--json"))
    return found


COUNTS = ("steps", "stretches")
"""What was done; the rest is what it cost."""


def test_steps_cost_no_more_than_is_stored(figures: dict[str, dict[str, float]]) -> None:
    stored = json.loads(BENCHMARK.with_suffix(".json").read_text())
    assert figures.keys() == stored.keys()
    for case, row in figures.items():
        for name, value in row.items():
            if name in COUNTS:
                assert value == stored[case][name], f"{case}: {name}"
                continue
            slack.hold(f"{case}: {name}", value, stored[case][name])


def test_a_million_steps_a_second_leave_time_to_spare(figures: dict[str, dict[str, float]]) -> None:
    assert 999_000 * figures["cruise"]["all"] * 1.3 < 0.9 * 168e6


def test_the_machine_code_computes_what_cpython_does() -> None:
    assert interpreters.run("cpython", BENCHMARK, "--verify") == "the same\n"
