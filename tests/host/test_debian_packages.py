"""Packages for the tests: the locked file or none, and what stands in the lock is all that the tests need."""

from __future__ import annotations

import hashlib
import importlib
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.interpreters import ROOT

CONTENT = b"a package"


@pytest.fixture
def debian(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The module of ``.ci``, with an archive of one package on this disk, in the lock with its checksum."""
    monkeypatch.syspath_prepend(str(ROOT / ".ci"))
    module = importlib.import_module("debian")
    monkeypatch.delitem(sys.modules, "debian")
    path = tmp_path / "pool" / "p" / "micropython_1_armhf.deb"
    path.parent.mkdir(parents=True)
    path.write_bytes(CONTENT)
    lock = tmp_path / "lock"
    lock.write_text(f"{hashlib.sha256(CONTENT).hexdigest()} pool/p/{path.name}\n")
    monkeypatch.setattr(module, "LOCK", lock)
    monkeypatch.setattr(module, "WAITS_S", ())
    monkeypatch.setattr(module, "archive_address", lambda: tmp_path.as_uri())
    return module


def test_the_file_that_the_lock_names_is_taken(debian: ModuleType, tmp_path: Path) -> None:
    archive = debian.Archive("armhf", tmp_path / "cache")
    archive._download(["micropython"])
    assert [file.read_bytes() for file in archive.folder.glob("*.deb")] == [CONTENT]


@pytest.mark.parametrize("content", [b"another", None])
def test_another_file_is_not(debian: ModuleType, tmp_path: Path, content: bytes | None) -> None:
    package = tmp_path / "pool" / "p" / "micropython_1_armhf.deb"
    package.unlink() if content is None else package.write_bytes(content)
    archive = debian.Archive("armhf", tmp_path / "cache")
    with pytest.raises(debian.Missing, match=r"micropython_1_armhf\.deb"):
        archive._download_locked("micropython")
    with pytest.raises(debian.Missing, match="apt-get"):  # nor does its list name one
        archive.unpack(["micropython"], tmp_path / "root")
    assert not [*archive.folder.glob("*.deb")]


def test_a_package_of_another_architecture_is_not(debian: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(debian.Missing, match="no micropython for amd64"):
        debian.Archive("amd64", tmp_path / "cache")._download_locked("micropython")
