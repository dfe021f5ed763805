"""The board's tab: stored motions, self-test, program."""

from __future__ import annotations

from typing import Any

from armtempo.link.board_messages import StoredMotion
from armtempo.panel import words
from armtempo.panel.panel_board import PanelBoard
from nicegui import ui

from tests.host.panel.fakes import board_state
from tests.host.panel.pages import Page, pages


def opened(page: Page) -> Any:
    """The tab, with what it reads from the board; the board."""
    page.operator.live.state = board_state()
    page.show(words.TAB_BOARD)
    page.look()
    return page.operator.board


def test_a_virtual_board_tests_itself_with_its_drivers_switched_off(operator: PanelBoard) -> None:
    """It has no reset button, for which it would ask."""
    with pages(operator) as page:
        board = opened(page)
        page.press(words.SELFTEST)
        page.answer(words.SELFTEST)
        page.done()
        assert board.calls == [("drivers", False), ("selftest",)]
        rows = [row for table in page.elements(ui.table) if table.visible for row in table.rows]
        assert {"pulses"} <= {row.get("part") for row in rows}


def test_what_another_program_stores_is_shown(operator: PanelBoard) -> None:
    with pages(operator) as page:
        board = opened(page)
        assert any(text.startswith("feed · ") for text in page.texts())
        board.stored = [StoredMotion("day", 100, 1, 0, 0, True, True)]
        operator.live.state = board_state(free_flash=1000)
        page.look()
        assert f"day · {words.A_SEQUENCE}{words.BY_BUTTON}" in page.texts()
        assert not any(text.startswith("feed · ") for text in page.texts())


def test_what_is_empty_says_so(operator: PanelBoard) -> None:
    operator.board.stored = []  # type: ignore[attr-defined]
    with pages(operator) as page:
        page.show(words.TAB_BOARD)
        page.look()
        assert words.NO_BOARD in page.texts()
        opened(page)
        page.act(page.of.refresh)
        assert words.NOTHING_STORED in page.texts()
        assert words.NO_BOARD not in page.texts()


def test_stored_motions_are_run_renamed_and_removed(operator: PanelBoard) -> None:
    with pages(operator) as page:
        board = opened(page)
        page.press(words.RENAME)
        page.named(words.NEW_NAME).set_value("food")
        page.answer(words.RENAME)
        page.done()
        page.press(words.REMOVE)
        page.answer(words.REMOVE)
        page.done()
        page.press(words.RUN)
        page.done()
        assert [call[:3] for call in board.calls] == [
            ("rename", "feed", "food"),
            ("remove", "feed"),
            ("run", "feed", 1),
        ]


def test_a_firmware_that_is_not_there_is_said(operator: PanelBoard) -> None:
    with pages(operator) as page:
        opened(page)
        page.press(words.FLASH)
        page.answer(words.FLASH)
        page.done()
        assert any(text.startswith("Flash: no firmware given") for text in page.texts())
