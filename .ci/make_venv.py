"""Make the environment .venv, also on a Debian without the python3-venv package.

Debian splits pip's own wheel from Python; where it is missing, it is taken from the Debian archive,
unpacked into the cache and used once to install pip. No root is needed.
"""

from __future__ import annotations

import subprocess
import sys
import venv
from pathlib import Path

from debian import Archive, Missing, need_debian

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
CACHE = ROOT / ".cache" / "pip"


def has_ensurepip() -> bool:
    """Whether Python can set up pip by itself here."""
    try:
        import ensurepip

        return bool(ensurepip.version())
    except (ImportError, StopIteration, OSError):
        return False


def bring_pip() -> None:
    """Install pip into the environment from Debian's wheel of it."""
    need_debian()
    CACHE.mkdir(parents=True, exist_ok=True)
    Archive("amd64", CACHE).unpack(["python3-pip-whl"], CACHE / "root")  # holds for every architecture
    wheel = next((CACHE / "root").rglob("pip-*.whl"))
    command = [str(VENV / "bin" / "python"), f"{wheel}/pip", "install", "--quiet", "pip"]
    if subprocess.run(command).returncode:
        raise Missing("pip could not be installed")


def main() -> int:
    """Make .venv; 1 with advice where that is not possible."""
    if sys.version_info < (3, 11):  # noqa: UP036 - run by whatever python3 is here
        print(
            f"armtempo needs Python 3.11 or newer, this is {sys.version.split()[0]}: make PYTHON=python3.11"
        )
        return 1
    with_pip = has_ensurepip()
    venv.create(VENV, with_pip=with_pip, clear=True, symlinks=True)
    try:
        if not with_pip:
            bring_pip()
    except Missing as reason:
        print(f"no environment: this Python comes without pip ({reason}); install the package python3-venv")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
