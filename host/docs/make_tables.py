"""Writes the tables of the pages that follow from the code: ``python host/docs/make_tables.py``."""

import inspect
import math
from collections.abc import Callable
from dataclasses import MISSING
from pathlib import Path
from typing import Any

from armtempo import optimise
from armtempo.basics import toml_section
from armtempo.model import user_program
from armtempo.model.pallet import ArmPallet
from armtempo.model.parts import Driver, Encoder, JointModel, Load, Motor, Safety
from armtempo.model.tool import ArmTool
from armtempo.optimise.task import Number, Parameter
from armtempo_board.app.cell import Cell
from armtempo_board.app.pallet import Pallet

FOLDER = Path(__file__).parent


def page(name: str) -> str:
    """A page with its generated tables brought up to date."""
    text = (FOLDER / name).read_text(encoding="utf-8")
    for table, body in TABLES[name].items():
        begin, end = f"<!-- {table} -->\n", f"<!-- end of {table} -->"
        before, rest = text.split(begin)
        text = before + begin + body() + end + rest.split(end)[1]
    return text


def _parameters() -> str:
    """Those that several algorithms share on one line."""
    found: dict[tuple[str, Parameter], list[str]] = {}
    for algorithm in optimise.ALGORITHMS:
        for name, parameter in optimise.parameters(algorithm).items():
            found.setdefault((name, parameter), []).append(f"`{algorithm}`")
    lines = ["| of | parameter | meaning | default | allowed |", "|---|---|---|---|---|"]
    for (name, parameter), algorithms in found.items():
        if isinstance(parameter, Number):
            default, allowed = f"{parameter.default:g}", f"{parameter.least:g} to {parameter.most:g}"
        else:
            default, allowed = (
                f'`"{parameter.default}"`',
                ", ".join(f'`"{word}"`' for word in parameter.words),
            )
        cells = (", ".join(algorithms), f"`{name}`", parameter.meaning, default, allowed)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _keys(of: type, name: str) -> Callable[[], str]:
    """The keys of a table of the arm file, from the fields that they are read into."""

    def body() -> str:
        lines = [f"| key of `{name}` | meaning | default |", "|---|---|---|"]
        for one, key in toml_section.keys(of):
            default = "required" if one.default is MISSING else _value(one.default)
            lines.append(f"| `{one.name}` | {key.meaning}{_allowed(key)} | {default} |")
        return "\n".join(lines) + "\n"

    return body


def _allowed(key: toml_section.Key) -> str:
    if key.choices:
        return f": {' or '.join(map(_value, key.choices))}"
    return "" if math.isinf(key.most) else f"; {_value(key.least)} to {_value(key.most)}"


def _value(value: Any) -> str:
    """As a TOML file has it; thousands apart."""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, str):
        return f'`"{value}"`'
    return f"{value:_.10g}".replace("_", " " if abs(value) >= 10_000 else "")


def _cell() -> str:
    """The calls of a user's program."""
    return _calls(Cell, "cell")


def _pallet() -> str:
    """Those of its pallets."""
    return _calls(Pallet, "tray")


def _calls(of: type, called: str) -> str:
    lines = ["| call | what it does |", "|---|---|"]
    for name, call in vars(of).items():
        if name.startswith("_") or not inspect.isfunction(call) or name in user_program.INTERNAL:
            continue
        given = [
            f"{one.name}={one.default!r}"
            if one.default is not inspect.Parameter.empty
            else str(one).split(":")[0]
            for one in [*inspect.signature(call).parameters.values()][1:]
        ]
        asked = "await " if inspect.iscoroutinefunction(call) else ""
        said = " ".join((inspect.getdoc(call) or "").split())
        lines.append(f"| `{asked}{called}.{name}({', '.join(given)})` | {said} |")
    return "\n".join(lines) + "\n"


TABLES = {
    "optimisers.md": {"parameters": _parameters},
    "files.md": {
        "keys of driver": _keys(Driver, "[driver]"),
        "keys of safety": _keys(Safety, "[safety]"),
        "keys of motor": _keys(Motor, "motor"),
        "keys of encoder": _keys(Encoder, "encoder"),
        "keys of load": _keys(Load, "[load.NAME]"),
        "keys of tool": _keys(ArmTool, "[tool.NAME]"),
        "keys of pallet": _keys(ArmPallet, "[pallet.NAME]"),
    },
    "programs.md": {"cell": _cell, "pallet": _pallet},
    "virtual-board.md": {"keys of model": _keys(JointModel, "model")},
}

if __name__ == "__main__":
    for name in TABLES:
        (FOLDER / name).write_text(page(name), encoding="utf-8")
