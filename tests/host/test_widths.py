"""What commands print: within the terminal's width, no word broken in two."""

from __future__ import annotations

import random
import re
from dataclasses import replace

import pytest
from armtempo.basics.text import aligned, wrapped
from armtempo.cli import main, state
from armtempo.cli.commands import COMMANDS
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.robot.board_state import JointState, record_crc
from click.testing import CliRunner

from tests.host.test_arm_check import STATE
from tests.interpreters import ROOT

SEED = 5
READ_BY_PROGRAMS = {
    "exchange.py": 1,  # CSV
    "help.py": 1,  # a page
    "jog_screen.py": 5,  # fits its line to the terminal itself
    "panel.py": 1,  # an address
    "results.py": 3,
    "sequences.py": 2,  # a line that is written again and again
    "teach.py": 2,  # TOML, and a line that is written again and again
    "virtual_board.py": 1,  # a path
}
"""Files that print without ``results.echo``, and how often."""


def test_wrapping_changes_spaces_only() -> None:
    rng = random.Random(SEED)
    print(f"seed {SEED}")
    for _ in range(500):
        words = ["x" * rng.randint(1, 25) for _ in range(rng.randint(1, 60))]
        before = rng.choice(["", "board     ", "hint: ", "note:    ", "         -> ", "joint 1  ", "    "])
        width = rng.randint(40, 120)
        lines = wrapped(before + " ".join(words), width)
        assert " ".join(lines).split() == (before + " ".join(words)).split()
        assert max(map(len, lines)) <= width
        text = 2 if before in ("", "joint 1  ") else len(before)
        assert all(line.startswith(" " * text + "x") for line in lines[1:])


def test_a_word_that_is_longer_stays_whole() -> None:
    path = "/a/" + "very-long-" * 12
    assert wrapped(f"written: {path} and more", 40) == [
        f"written: {path}",
        "         and more",
    ]


def test_columns_are_no_wider_than_needed_where_they_would_not_fit() -> None:
    assert aligned([("a", "b"), ("c", "d")], (3, 6)) == ["a       b", "c       d"]
    assert aligned([("a", "b"), ("c", "d")], (3, 6), 8) == ["a b", "c d"]


def test_commands_print_through_the_function_that_wraps() -> None:
    found = {
        path.name: count
        for path in (ROOT / "host" / "armtempo" / "cli").glob("*.py")
        if (count := len(re.findall(r"click\.echo|[^.\w]print\(", path.read_text(encoding="utf-8"))))
    }
    assert found == READ_BY_PROGRAMS


LINES = [
    *(("check", "--arm", name) for name in shipped.files()),
    ("fk", "0,-60,40", "--arm", "paper"),
    ("ik", "--position", "240", "180", "80", "--arm", "paper"),
    ("ik", "--position", "2400", "180", "80", "--arm", "ar4"),
    ("config",),
    ("ports",),
    ("help",),
    ("plan", "--corridor-mm", "5", "--path", "free", "--population", "1"),
    ("plan", "--holds", "something that no arm file names", "--arm", "paper"),
    ("report", "a/folder/that/is/not/there/and/has/a/long/name/so/that/its/message/does/not/fit/a/line"),
]


@pytest.mark.slow
@pytest.mark.parametrize("arguments", LINES, ids=" ".join)
def test_every_line_fits(arguments: tuple[str, ...]) -> None:
    wide, narrow = (
        CliRunner(env={"COLUMNS": columns}).invoke(main, list(arguments)).output for columns in ("1000", "80")
    )
    assert too_long(narrow) == []
    assert narrow.split() == wide.split()
    assert broken(wide, narrow) == []


_ROW = re.compile(r"(?=.*\S {2,}\S+ {2,}\S).*?(?= {2,}[a-z]+[,:] |$)")
"""The columns of a table's row, without a remark such as "rejected: …" behind them."""


def broken(wide: str, narrow: str) -> list[str]:
    """Rows of tables whose columns are on several lines where the terminal is narrow."""
    rows = [found[0].rstrip() for line in wide.splitlines() if (found := _ROW.match(line))]
    return [row for row in rows if not any(line.startswith(row) for line in narrow.splitlines())]


def test_a_wrapped_row_of_a_table_is_noticed() -> None:
    row = "          base         -170.00°  (-75555 steps)  encoder -170.00° (-75555 counts)"
    assert broken(row, "\n".join(wrapped(row, 80))) == [row]
    cells = "   2      216.8699    -84.2360    134.3750"
    remark = f"{cells}  rejected: {'a word ' * 9}"
    assert broken(remark, "\n".join(wrapped(remark, 80))) == []
    assert broken(remark, "\n".join(wrapped(remark, 40))) == [cells]


@pytest.mark.parametrize("name", shipped.files())
@pytest.mark.parametrize("end", [0, 1], ids=["low", "high"])
def test_the_positions_of_a_board_fit_at_the_ends_of_the_ranges(name: str, end: int) -> None:
    arm = Arm.load(shipped.files()[name])
    gears = arm.transmission
    steps = gears.whole_steps([joint.range_deg[end] for joint in arm.driven])
    turned = [number / per_deg for number, per_deg in zip(steps, gears.steps_per_deg, strict=True)]
    counts = [round(angle * per_deg) for angle, per_deg in zip(turned, gears.counts_per_deg, strict=True)]
    pairs = zip(steps, counts, strict=True)
    joints = tuple(JointState("joint", True, *_unnamed(*pair)) for pair in pairs)
    found = replace(STATE, arm="", arm_crc=record_crc(arm), joints=joints).named(arm)
    assert found.arm
    lines = state.motion_lines(found)
    assert [line for line in lines if len(line) > 80] == []
    rows = [line for line in lines if " steps)" in line]
    assert len(rows) == len(arm.driven)
    assert len({line.index(" steps)") for line in rows}) == 1


def _unnamed(steps: int, counts: int) -> tuple[int, None, int, None]:
    """What a board says of a joint."""
    return steps, None, counts, None


def too_long(text: str) -> list[str]:
    """Lines of more than a word that do not fit."""
    return [line for line in text.splitlines() if len(line) > 80 and " " in line.strip()]


def test_every_line_of_help_fits() -> None:
    for name in COMMANDS:
        assert too_long(CliRunner().invoke(main, [name, "--help"]).output) == [], name
