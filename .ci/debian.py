"""Debian packages without installing them: downloaded and unpacked into a folder.

The files that ``debian.lock`` names come first. Where the archive has others by now, they come through package lists
of our own; a mirror may offer none that is whole for days.
"""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

LOCK = Path(__file__).with_name("debian.lock")
WAITS_S = (5, 20, 60)
"""Before each further try: an archive may be out of reach for a moment."""

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
    """Debian 13 packages of one architecture."""

    def __init__(self, architecture: str, cache: Path) -> None:
        self._architecture = architecture
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

    def unpack(self, packages: list[str], root: Path) -> None:
        """Download the packages and unpack them below ``root``; Missing where they cannot be had."""
        for old in self.folder.glob("*.deb"):
            old.unlink()
        for wait_s in (*WAITS_S, 0):
            try:
                self._download(packages)
                break
            except Missing as reason:
                if not wait_s:
                    raise
                print(f"{reason}; again in {wait_s} s", file=sys.stderr)
                time.sleep(wait_s)
        root.mkdir(parents=True, exist_ok=True)
        for package in self.folder.glob("*.deb"):
            self._run("dpkg", "-x", str(package), str(root))

    def _download(self, packages: list[str]) -> None:
        try:
            for package in packages:
                self._download_locked(package)
        except Missing as reason:
            print(f"{reason}: the archive's list is asked", file=sys.stderr)
            for file in self.folder.glob("*.deb"):
                file.unlink()
            self._run("apt-get", *self.options, "-q", "update")
            self._run("apt-get", *self.options, "-q", "download", *packages)

    def _download_locked(self, package: str) -> None:
        """The file that the lock names for the package; Missing where the archive has no such file or another."""
        wanted = re.compile(rf"(\w{{64}}) (pool/\S+/({re.escape(package)}_\S+_{self._architecture}\.deb))")
        found = [match for match in map(wanted.fullmatch, LOCK.read_text().splitlines()) if match]
        if not found:
            raise Missing(f"{LOCK.name} names no {package} for {self._architecture}")
        sha256, path, name = found[0].groups()
        try:
            with urllib.request.urlopen(f"{archive_address().rstrip('/')}/{path}", timeout=60) as answer:
                data = answer.read()
        except (OSError, ValueError) as reason:
            raise Missing(f"{name}: {reason}") from reason
        if hashlib.sha256(data).hexdigest() != sha256:
            raise Missing(f"{name} is not the file that {LOCK.name} names")
        (self.folder / name).write_bytes(data)

    def _run(self, *command: str) -> None:
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True)
        if done.returncode:
            said = [line for line in done.stderr.splitlines() if line.startswith(("E:", "W:"))]
            raise Missing(f"{command[0]} failed: {' '.join(said[-2:]) or done.stderr.strip()}")
