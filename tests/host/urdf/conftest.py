"""Fixtures for tests of URDF."""

from __future__ import annotations

import pytest
from armtempo.new_arm import urdf_fitting as fitting


@pytest.fixture(autouse=True)
def _few_postures(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reader's own forward kinematics takes a millisecond a posture."""
    monkeypatch.setattr(fitting, "POSTURES", 100)
