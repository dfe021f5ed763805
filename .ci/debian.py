"""Debian packages without installing them: downloaded through lists of our own, unpacked into a folder."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

SUITE = "trixie"
KEYRING = "/usr/share/keyrings/debian-archive-keyring.gpg"


class Missing(Exception):
    """Why something could not be brought."""


def need_debian() -> None:
    """Missing where Debian's packages cannot be used."""
    for tool in ("apt-get", "dpkg"):
        if shutil.which(tool) is None:
            raise Missing(f"there is no {tool} here to bring it")


def archive_address() -> str:
    """The Debian archive that this machine's own apt uses."""
    files = [Path("/etc/apt/sources.list"), *sorted(Path("/etc/apt/sources.list.d").glob("*"))]
    for file in files:
        if not file.is_file():
            continue
        for line in file.read_text(errors="replace").splitlines():
            if re.match(r"\s*(URIs:|deb\s)", line):
                for address in re.findall(r"[a-z+]+:/\S+", line):
                    if re.search(r"/debian/?$", address):
                        return str(address)
    raise Missing("apt on this machine names no Debian archive")


class Archive:
    """Debian 13 packages of one architecture, seen through lists of our own."""

    def __init__(self, architecture: str, cache: Path) -> None:
        self.folder = cache / f"apt-{architecture}"
        lists = self.folder / "lists"
        for folder in (lists / "partial", self.folder / "cache" / "archives" / "partial"):
            folder.mkdir(parents=True, exist_ok=True)
        signed = f"[signed-by={KEYRING}] " if Path(KEYRING).exists() else ""
        (self.folder / "sources.list").write_text(f"deb {signed}{archive_address()} {SUITE} main\n")
        (self.folder / "status").touch()
        config = {
            "Dir::Etc::sourcelist": "sources.list",
            "Dir::Etc::sourceparts": "/dev/null",
            "Dir::State::Lists": "lists",
            "Dir::State::status": "status",
            "Dir::Cache": "cache",
            "APT::Architecture": architecture,
            "APT::Architectures": architecture,
            "APT::Sandbox::User": "",
            "Acquire::Languages": "none",
            "Acquire::Retries": "3",
        }
        self.options = []
        for key, value in config.items():
            if key.startswith("Dir::") and not value.startswith("/"):
                value = str(self.folder / value)
            self.options += ["-o", f"{key}={value}"]
        self._run("apt-get", *self.options, "-q", "update")

    def _run(self, *command: str) -> None:
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True)
        if done.returncode:
            tail = (done.stderr or done.stdout).strip().splitlines()[-1:]
            raise Missing(f"{command[0]} failed: {' '.join(tail)}")

    def unpack(self, packages: list[str], root: Path) -> None:
        """Download the packages and unpack them below ``root``."""
        for old in self.folder.glob("*.deb"):
            old.unlink()
        self._run("apt-get", *self.options, "-q", "download", *packages)
        root.mkdir(parents=True, exist_ok=True)
        for package in self.folder.glob("*.deb"):
            self._run("dpkg", "-x", str(package), str(root))
