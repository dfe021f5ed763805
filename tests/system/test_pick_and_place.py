"""``armtempo demo --pick-and-place``: the shipped sequence, with the part sensor imitated."""

from __future__ import annotations

from pathlib import Path

from tests import interpreters
from tests.system import commandline


def test_two_parts_are_placed(tmp_path: Path) -> None:
    environment = {"ARMTEMPO_MICROPYTHON": interpreters.starter("cpython")}
    done = commandline.run("demo", "--pick-and-place", folder=tmp_path, **environment)
    assert done.exit_code == 0, done.errors
    assert "cycle (step 2, 2 times):" in done.output
    assert done.output.splitlines()[-1] == "finished after 2 whole cycles"
    assert not list(tmp_path.iterdir())


def test_it_is_for_a_virtual_board(tmp_path: Path) -> None:
    done = commandline.run("demo", "--pick-and-place", "--port", "/dev/ttyACM0", folder=tmp_path)
    assert done.exit_code == 2
    done.said("this demo is for a virtual board")
