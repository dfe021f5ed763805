"""Write the numbers of constants that board modules have from others: ``python board/make_constants.py``.

``const`` folds within a module only, so each compiled module has its own ``_NAME = const(n)`` of what it uses of
others. From a line ``# as in HOME.py`` to the next empty one, or on a line that ends so, n is that of HOME's constant
of the same name, underscore or not, or what a comment ``# = FIRST_NODE + NODE_TIME`` says of HOME's constants.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

BOARD = Path(__file__).parent / "armtempo_board"
SHARED = Path(__file__).parents[1] / "shared" / "armtempo_shared"
_LINE = re.compile(r"(_?(\w+) = const\().*?(\)(?:\s+#(?: = ([A-Z0-9_ +-]+))?.*)?)$")
_HOME = re.compile(r"# .*\bas in (\w+)\.py")
_ARITHMETIC = (ast.BinOp, ast.UnaryOp, ast.Constant, ast.operator, ast.unaryop)


def constants(path: Path) -> dict[str, str]:
    """By name, without the underscore of private ones: the text of a number."""
    text, found = path.read_text(encoding="utf-8"), {}
    lines = text.splitlines()
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            value = node.value.args[0] if isinstance(node.value, ast.Call) and node.value.args else node.value
            if all(isinstance(part, _ARITHMETIC) for part in ast.walk(value)):
                line = lines[value.lineno - 1].encode()  # offsets are in bytes
                found[node.targets[0].id.lstrip("_")] = line[value.col_offset : value.end_col_offset].decode()
    return found


def written(path: Path) -> str:
    """The module with the numbers that follow from its homes; KeyError or NameError if one has no such constant."""
    homes: dict[str, dict[str, str]] = {}
    block, lines = "", []
    for line in path.read_text(encoding="utf-8").splitlines():
        named, found = _HOME.search(line), _LINE.match(line)
        if not found:
            block = named[1] if named else block if line.startswith("# of ") else ""
        elif home := named[1] if named else block:
            if home not in homes:
                (source,) = (*BOARD.rglob(f"{home}.py"), *SHARED.glob(f"{home}.py"))
                homes[home] = constants(source)
            known = homes[home]
            if found[4]:
                numbers = {name: eval(text) for name, text in known.items()}
                line = f"{found[1]}{eval(found[4], numbers)}{found[3]}"
            else:
                line = f"{found[1]}{known[found[2]]}{found[3]}"
        lines.append(line)
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write until nothing changes: a home may have constants of others too."""
    while changed := [
        path for path in BOARD.rglob("*.py") if written(path) != path.read_text(encoding="utf-8")
    ]:
        for path in changed:
            path.write_text(written(path), encoding="utf-8")
            print(path.relative_to(BOARD))


if __name__ == "__main__":
    main()
