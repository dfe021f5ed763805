"""The page "A day with your arm": its commands, as they stand, on one virtual board."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

from armtempo.simulator import LaunchOptions, launch

from tests import interpreters
from tests.interpreters import ROOT
from tests.system import commandline
from tests.system.conftest import FASTEST

PAGE = (ROOT / "host" / "docs" / "day.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|toml)\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
PORT = "/dev/ttyACM0"


def put(text: str, folder: Path) -> None:
    """What stands in a file by its first line."""
    first, rest = text.split("\n", 1)
    name = first.split()[-1]
    added = (folder / name).read_text() + "\n" if "at the end of" in first else ""
    (folder / name).write_text(added + rest)


def test_its_commands_one_after_the_other(tmp_path: Path) -> None:
    folder = tmp_path
    outputs: dict[str, str] = {}
    with launch(LaunchOptions(tmp_path / "flash", interpreter=interpreters.starter(FASTEST))) as board:
        for kind, text in BLOCKS:
            if kind == "toml":
                put(text, folder)
                continue
            for line in text.splitlines():
                words = shlex.split(line)
                if words[0] == "cd":
                    folder /= words[1]
                    continue
                arguments = [board.port if word == PORT else word for word in words[1:]]
                done = commandline.run(*arguments, folder=folder, ARMTEMPO_PORT=board.port)
                assert done.exit_code == 0, f"{line}: {done.output}{done.errors}"
                outputs[line] = done.output
    assert re.search(r"^state +idle", outputs["armtempo status"], re.MULTILINE), outputs["armtempo status"]
    assert "finished after 2 whole cycles; parts 2" in outputs["armtempo run feed.json --speed 60"]
    assert "feed *" in outputs["armtempo list"]
    postures = re.findall(r"^\[posture\.(\w+)\]", (folder / "arm.toml").read_text(), re.MULTILINE)
    assert postures == ["above_feeder", "at_feeder", "above_tray"]
    assert json.loads((folder / "feed.json").read_text())["format"].startswith("armtempo sequence")
