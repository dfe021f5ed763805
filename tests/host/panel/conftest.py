"""Fixtures of the panel's tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:  # collected without the extra too
    from armtempo.panel.panel_board import PanelBoard


@pytest.fixture
def operator(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[PanelBoard]:
    """An operator of a board that only jogs; one page has control."""
    from tests.host.panel import fakes

    monkeypatch.setattr("armtempo.panel.panel_board.LOOK_S", 1000.0)  # the board is never asked for its state
    monkeypatch.setattr("armtempo.panel.hold.ALIVE_S", fakes.HELD_S)
    made = fakes.operator(fakes.Board(), tmp_path)
    made.take_control(fakes.ME)
    yield made
    made.close()
