"""Put starters of the MicroPython interpreters that the tests need into .cache/micropython.

``micropython``: the one on PATH, else Debian 13's. ``micropython-arm``: Debian 13's for 32-bit Arm, under qemu, which
apt-get installs if this is root. Debian 12 packages no MicroPython, and one machine cannot install it for two
architectures; so Debian 13's files, those that ``debian.lock`` names, are unpacked into the cache and started there.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path

LOCK = Path(__file__).with_name("debian.lock")
CACHE = Path(__file__).resolve().parent.parent / ".cache" / "micropython"
PROBE = "import struct; print(struct.calcsize('P'))"


class Missing(Exception):
    """Why an interpreter is not available, and what to do."""


def archive_address() -> str:
    """The Debian archive that this machine's own apt uses."""
    for file in [Path("/etc/apt/sources.list"), *sorted(Path("/etc/apt/sources.list.d").glob("*"))]:
        text = file.read_text(errors="replace") if file.is_file() else ""
        found = re.search(r"^\s*(?:URIs:|deb\s).*?([a-z+]+:/\S+/debian)/?\s", text, re.MULTILINE)
        if found:
            return found[1]
    raise Missing("apt on this machine names no Debian archive")


def unpack(architecture: str) -> Path:
    """A folder with the files that the lock names for an architecture."""
    root = CACHE / architecture
    for line in LOCK.read_text().splitlines():
        sha256, path = line.split()
        if not path.endswith(f"_{architecture}.deb"):
            continue
        try:
            with urllib.request.urlopen(f"{archive_address()}/{path}", timeout=60) as answer:
                data = answer.read()
        except OSError as reason:
            raise Missing(f"{path}: {reason}; a newer version needs a new line in {LOCK.name}") from reason
        if hashlib.sha256(data).hexdigest() != sha256:
            raise Missing(f"{path} is not the file that {LOCK.name} names")
        package = CACHE / Path(path).name
        package.write_bytes(data)
        subprocess.run(["dpkg", "-x", package, root], check=True)
        package.unlink()
    return root


def native() -> list[str]:
    """Command of an interpreter of this machine's word size."""
    if found := shutil.which("micropython"):
        return [found]
    if platform.machine() != "x86_64" or not shutil.which("dpkg"):
        raise Missing("install MicroPython: apt-get, brew and others call it micropython")
    root = unpack("amd64")
    loader, libraries = root / "usr/lib64/ld-linux-x86-64.so.2", root / "usr/lib/x86_64-linux-gnu"
    return [str(loader), "--library-path", str(libraries), str(root / "usr/bin/micropython")]


def arm() -> list[str]:
    """Command of an interpreter of 32-bit Arm code."""
    if not shutil.which("dpkg"):
        raise Missing("needs Debian or Ubuntu")
    if not shutil.which("qemu-arm"):
        if os.geteuid():
            raise Missing("install qemu: sudo apt-get install qemu-user")
        subprocess.run(["apt-get", "-qq", "update"], check=True)
        subprocess.run(
            ["apt-get", "-qq", "install", "-y", "--no-install-recommends", "qemu-user"], check=True
        )
    root = unpack("armhf")
    (root / "lib").symlink_to("usr/lib")
    return ["qemu-arm", "-L", str(root), str(root / "usr/bin/micropython")]


def word_size(starter: Path) -> int:
    """Bytes of a pointer in the interpreter; 0 if it does not run."""
    try:
        done = subprocess.run([starter, "-c", PROBE], capture_output=True, text=True, timeout=60)
    except OSError:
        return 0
    return int(done.stdout) if done.returncode == 0 and done.stdout.strip().isdigit() else 0


def main() -> int:
    """Get both; code 1 in CI if one is missing. Elsewhere the tests say what they leave out."""
    CACHE.mkdir(parents=True, exist_ok=True)
    missing = 0
    for name, command, sizes in (("micropython", native, (4, 8)), ("micropython-arm", arm, (4,))):
        starter = CACHE / name
        if word_size(starter) in sizes:
            continue
        try:
            shutil.rmtree(CACHE / ("armhf" if command is arm else "amd64"), ignore_errors=True)
            words = " ".join(map(shlex.quote, command()))
            starter.write_text(f'#!/bin/sh\nexec {words} "$@"\n')
            starter.chmod(0o755)
            if word_size(starter) not in sizes:
                raise Missing(f"{words} does not run")
            print(f"{name}: ready")
        except (Missing, OSError, subprocess.CalledProcessError) as reason:
            starter.unlink(missing_ok=True)
            missing = 1
            print(f"{name}: left out: {reason}", file=sys.stderr)
    return missing if os.environ.get("CI") else 0


if __name__ == "__main__":
    sys.exit(main())
