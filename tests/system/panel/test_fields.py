"""What is typed into the panel, or comes from files: wrong input, and names that are no names."""

from __future__ import annotations

import re
import shutil
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from armtempo.basics import toml_table
from armtempo.model import shipped
from armtempo.panel import words

from tests.system import commandline, panels
from tests.system.panel.files import MARKUP, SEQUENCE, TABS, open_sequence, paste, show
from tests.system.panels import Panel, home, refusal_of

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("panel")]
_FIELDS = """() => [...document.querySelectorAll('.q-tab-panel input:not([role=combobox])')]
  .filter(one => one.checkVisibility() && one.ariaLabel).map(one => [one.ariaLabel, one.type])"""
_STEP_KEYS = {name: key for key, name in {**words.STEP_KINDS, **words.STEP_KEYS}.items()}


def put(content: Any, label: str, text: str) -> None:
    """Write into the content of a file what is typed in the field of this label."""
    value = toml_table.typed(text)
    if via := re.fullmatch(r"P(\d+) joint (\d+)", label):
        content["via_deg"][int(via[1])][int(via[2]) - 1] = value
    elif step := re.fullmatch(r"step (\d+): (.*)", label):
        content["step"][int(step[1]) - 1][_STEP_KEYS[step[2]]] = value
    else:
        content[{name: key for key, name in words.OPTIONS.items()}[label]] = value


def refusal(folder: Path, name: str, text: str, command: str = "plan --arm arm.toml") -> str:
    """What the command line says of a file."""
    (folder / name).write_text(text)
    ended = commandline.run(*command.split(), name, folder=folder)
    assert ended.exit_code == 2
    return ended.errors.splitlines()[0].removeprefix("armtempo: ")


@pytest.mark.parametrize(
    ("tab", "file", "button", "count"),
    [("Job", "job.toml", "Plan", 11), ("Sequence", "all.toml", "Save", 19)],
)
def test_each_field_refuses_wrong_input_in_the_words_of_the_command_line(
    page: Any, panel: Panel, tmp_path: Path, tab: str, file: str, button: str, count: int
) -> None:
    folder = panel.folder  # of a wrong job there the panel would take the rest
    if tab == "Job":
        folder = tmp_path
        show(page, tab)
        shutil.copy(panel.folder / "arm.toml", folder)
        shown = paste(page, wrong := "1;2\n3;4")
        assert refusal(folder, "the pasted rows", wrong, "import --arm arm.toml") in shown
        paste(page, "0;-60;40\n20;-75;50")
        page.wait_for_selector('[aria-label="P2 joint 1"]', state="detached")  # the table is built anew
        good = 'name = "feed"\ntiming = "shared"\nvia_deg = [[0.0, -60.0, 40.0], [20.0, -75.0, 50.0]]\n'
    else:
        good = SEQUENCE
        show(page, tab)
        open_sequence(page, file, "step 10: end of")
    fields = page.evaluate(_FIELDS)
    assert len(fields) == count
    for number, (label, kind) in enumerate(fields[::3]):  # the others are of the same kinds
        field = page.get_by_label(label, exact=True)
        before, wrong = field.input_value(), MARKUP if kind == "text" else ("999999", "")[number % 2]
        content = tomlkit.parse(good)
        put(content, label, wrong)
        field.fill(wrong)
        page.wait_for_timeout(300)
        assert field.input_value() == wrong  # not lost as what was typed in the field before it is taken
        control = page.get_by_role("button", name=button, exact=True)
        shown = refusal_of(page, control, partial(control.press, "Enter"))
        said = refusal(folder, file, tomlkit.dumps(content))
        said = (words.of_job if tab == "Job" else words.of_sequence)(said)
        assert said.replace(".0", "") in shown.replace(".0", "")
        field.fill(before)
        if tab == "Sequence":
            (folder / file).write_text(SEQUENCE)  # as it was when it was opened
    assert page.evaluate("window.hurt") is None


def test_names_from_files_are_text(chromium: Any, tmp_path: Path) -> None:
    names = [
        'j"><img src=x onerror=window.hurt=1>',
        'k\' :innerHTML="hurt=2" onclick="window.hurt=3"',
        "`${hurt=4}`",
    ]
    text = tmp_path / "own.toml"
    content = tomlkit.parse(shipped.arm_path().read_text())
    for joint, name in zip([one for one in content["joint"] if "motor" in one], names, strict=True):  # type: ignore[union-attr]
        joint["name"] = name
    text.write_text(tomlkit.dumps(content))
    with panels.panels(tmp_path, arm=str(text)) as running:
        window = chromium.new_context(viewport=panels.SMALL)
        page = panels.opened(window, running().address, drawn=False)
        home(page)
        for name in names:
            assert page.get_by_label(f"{name} +", exact=True).inner_text().strip() == "+"
            assert page.get_by_text(name, exact=True).first.is_visible()
        for tab in TABS:
            show(page, tab)
            page.wait_for_selector(f".q-tab--active:has-text('{tab}')")
        page.wait_for_timeout(500)
        assert page.evaluate("window.hurt") is None
        blocked = "document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=window.hurt=5>')"
        page.evaluate(blocked)  # and what would get in all the same is not run
        page.wait_for_timeout(500)
        assert page.evaluate("window.hurt") is None
        window.close()
