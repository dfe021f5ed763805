"""Fixtures of the panel's tests."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from armtempo.model.arm import Arm

if TYPE_CHECKING:  # collected without the extra too
    from armtempo.panel.panel_board import PanelBoard


@pytest.fixture
def operator_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[Arm], PanelBoard]]:
    """Makes operators of a board that only jogs this arm."""
    from tests.host.panel import fakes

    monkeypatch.setattr("armtempo.panel.board_link.LOOK_S", 1000.0)  # the board is never asked for its state
    with ExitStack() as ends:

        def of(arm: Arm) -> PanelBoard:
            made = fakes.operator(fakes.Board(), tmp_path, arm)
            ends.callback(made.close)
            return made

        yield of


@pytest.fixture
def operator(operator_of: Callable[[Arm], PanelBoard], monkeypatch: pytest.MonkeyPatch) -> PanelBoard:
    """One of the paper's arm; one page has control."""
    from tests.host.panel import fakes

    monkeypatch.setattr("armtempo.panel.hold.ALIVE_S", fakes.HELD_S)
    made = operator_of(fakes.ARM)
    made.take_control(fakes.ME)
    return made
