"""A short soak; ``python -m tests.benchmark.soak`` runs a long one."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests import interpreters
from tests.system import soak

LEGS = {"cpython": 10, "micropython": 30}
"""At least so many motions."""
SEED = 20268


@pytest.fixture(scope="module")
def flash(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("soak") / "flash"
    soak.make_flash(folder)
    return folder


@pytest.mark.xdist_group("soak")  # whose flash takes seconds to make
@pytest.mark.parametrize("name", [name for name in interpreters.AVAILABLE if name in LEGS])
def test_every_motion_makes_the_steps_of_its_record(name: str, flash: Path, tmp_path: Path) -> None:
    copied = shutil.copytree(flash, tmp_path / "flash")
    print(soak.run(name, copied, LEGS[name], SEED))
