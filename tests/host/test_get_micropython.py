"""Interpreters for the tests: the file that the lock names, or none."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from tests.interpreters import ROOT


@pytest.mark.parametrize("content", [b"another file", None])
def test_a_file_that_is_not_the_locked_one_is_not_unpacked(content: bytes | None, tmp_path: Path) -> None:
    names = runpy.run_path(str(ROOT / ".ci" / "get_micropython.py"))
    unpack = names["unpack"]
    unpack.__globals__.update(CACHE=tmp_path / "cache", archive_address=tmp_path.as_uri)
    for line in names["LOCK"].read_text().splitlines():
        package = tmp_path / line.split()[1]
        package.parent.mkdir(parents=True, exist_ok=True)
        if content is not None:
            package.write_bytes(content)
    with pytest.raises(names["Missing"], match=r"micropython_.*_armhf\.deb.*debian\.lock"):
        unpack("armhf")
    assert not (tmp_path / "cache").exists()
