"""Writes the tables of the pages that follow from the code: ``python host/docs/make_tables.py``."""

from pathlib import Path

from armtempo import optimise
from armtempo.optimise.parameters import Number, Parameter

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


TABLES = {"optimisers.md": {"parameters": _parameters}}

if __name__ == "__main__":
    for name in TABLES:
        (FOLDER / name).write_text(page(name), encoding="utf-8")
