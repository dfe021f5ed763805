"""Files that the panel of the tests has, and how its tabs are shown."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from tests.system import panels

TABS = ("Move", "Job", "Run", "Sequence", "Board")


def show(page: Any, tab: str) -> None:
    """Go to a tab, also if notifications cover it."""
    page.get_by_role("tab", name=tab).dispatch_event("click")


SEQUENCE = """name = "all"
[[step]]
repeat = 2
[[step]]
goto = "home"
[[step]]
run = "job.toml"
[[step]]
output = "gripper"
to = "open"
holds = "nothing"
wait_s = 0.5
[[step]]
holds = "nothing"
[[step]]
wait_s = 1
[[step]]
wait_input = "part"
active = true
timeout_s = 3
on_timeout = "next"
[[step]]
count = "parts"
[[step]]
call = "other.toml"
[[step]]
end = "repeat"
"""
"""Each kind of step, with each of its keys."""
DAY = 'name = "day"  # my name\n\n[[step]]\ngoto = "home"\n\n[[step]]\nwait_s = 9  # it settles\n'
MARKUP = "<img src=x onerror=window.hurt=1>"


def paste(page: Any, text: str) -> str:
    """Paste rows of via points; why they were refused."""
    page.get_by_role("button", name="Paste").click()
    page.get_by_label("Rows of angles").fill(text)
    return panels.refusal_of_answer(page, "Paste")


def undo_all(page: Any) -> bool:
    """Show the job as it was opened; whether it was another."""
    undo, undone = page.get_by_role("button", name="Undo", exact=True), False
    for _ in range(100):
        if not undo.evaluate("one => { const on = !one.disabled; one.click(); return on; }"):
            return undone
        page.wait_for_timeout(300)  # grey a little later; a press that was late is made again
        undone = True
    raise AssertionError("there is always more to undo")


def open_sequence(page: Any, file: str, last: str) -> None:
    """Open the file of a sequence, until its last field is there; a list that is just being filled is opened again."""
    option = page.get_by_role("option", name=file)
    for _ in range(20):
        page.get_by_role("combobox", name="Sequence").press("ArrowDown")
        with suppress(Exception):  # a time-out
            option.wait_for(timeout=3000)
            break
    option.dispatch_event("click")
    page.get_by_label(last).wait_for()
