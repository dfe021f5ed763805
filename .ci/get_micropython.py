"""Bring the MicroPython interpreters that the tests need into .cache/micropython.

Two starters come to stand there: ``micropython`` (this machine's word size; the one on PATH where there is
one) and ``micropython-arm`` (32-bit Arm under qemu). On Debian-like machines what is missing is taken from
the Debian 13 archive, unpacked into the cache and started from there: nothing is installed and no root is
needed. Elsewhere what is missing is said, and left out.
"""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from debian import Archive, Missing, need_debian

CACHE = Path(__file__).resolve().parent.parent / ".cache" / "micropython"
LIBRARIES = ["libc6", "libffi8", "libmbedcrypto16", "libmbedtls21", "libmbedx509-7"]
PROBE = "import struct; print(struct.calcsize('P'))"


def write_starter(name: str, command: list[str]) -> None:
    """A shell script that runs ``command`` with the arguments it is given."""
    script = CACHE / name
    script.write_text("#!/bin/sh\nexec " + " ".join(shlex.quote(word) for word in command) + ' "$@"\n')
    script.chmod(0o755)


def word_size(name: str) -> int:
    """Bytes of a pointer in the interpreter behind a starter; 0 where it does not run."""
    try:
        done = subprocess.run([CACHE / name, "-c", PROBE], capture_output=True, text=True, timeout=60)
    except OSError:
        return 0
    return int(done.stdout) if done.returncode == 0 and done.stdout.strip().isdigit() else 0


def bring_native() -> None:
    """``micropython`` of this machine."""
    found = shutil.which("micropython")
    if found:
        write_starter("micropython", [found])
        return
    need_debian()
    architecture = {"x86_64": "amd64", "aarch64": "arm64"}.get(platform.machine())
    if architecture is None:
        raise Missing(f"no package is known for {platform.machine()}")
    root = CACHE / "root"
    Archive(architecture, CACHE).unpack(["micropython", *LIBRARIES], root)
    loader = next(root.glob("usr/lib*/ld-linux-*")) if any(root.glob("usr/lib*/ld-linux-*")) else None
    loader = loader or next(root.glob("usr/lib/*/ld-linux-*"))
    library = next(root.glob("usr/lib/*-linux-gnu"))
    write_starter(
        "micropython", [str(loader), "--library-path", str(library), str(root / "usr/bin/micropython")]
    )


def bring_arm() -> None:
    """``micropython-arm``: 32-bit Arm code under qemu's user mode emulation."""
    need_debian()
    emulator = shutil.which("qemu-arm") or shutil.which("qemu-arm-static")
    if emulator is None:
        architecture = {"x86_64": "amd64", "aarch64": "arm64"}.get(platform.machine(), "amd64")
        Archive(architecture, CACHE).unpack(["qemu-user"], CACHE / "qemu")
        emulator = str(CACHE / "qemu/usr/bin/qemu-arm")
    root = CACHE / "root-arm"
    Archive("armhf", CACHE).unpack(["micropython", "libgcc-s1", *LIBRARIES], root)
    if not (root / "lib").exists():
        (root / "lib").symlink_to("usr/lib")
    write_starter("micropython-arm", [emulator, "-L", str(root), str(root / "usr/bin/micropython")])


def main() -> int:
    """Bring both; exit code 0 even where one is missing (the tests then say what they leave out)."""
    CACHE.mkdir(parents=True, exist_ok=True)
    for name, bring, size in (("micropython", bring_native, 0), ("micropython-arm", bring_arm, 4)):
        if word_size(name):
            continue
        try:
            bring()
            if not word_size(name) or (size and word_size(name) != size):
                raise Missing("it was unpacked but does not run")
        except Missing as reason:
            (CACHE / name).unlink(missing_ok=True)
            print(f"{name}: not here: {reason}", file=sys.stderr)
            continue
        print(f"{name}: ready")
    if os.environ.get("CI") and not all(
        (CACHE / name).exists() for name in ("micropython", "micropython-arm")
    ):
        print("CI needs both interpreters", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
