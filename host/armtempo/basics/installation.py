"""How armtempo was installed, and so how a package that is missing comes to it."""

from __future__ import annotations

import sys
from pathlib import Path


def command(package: str, extra: str) -> str:
    """The command that adds ``package``, or armtempo's ``extra`` that brings it, to this installation."""
    if Path(sys.prefix, "pipx_metadata.json").exists():
        return f"pipx inject armtempo {package}"
    if Path(sys.prefix, "uv-receipt.toml").exists():
        return f"uv tool install 'armtempo[{extra}]'"
    return f"pip install 'armtempo[{extra}]'"


def upgrade(package: str) -> str:
    """The command that brings a package of this installation up to date."""
    if Path(sys.prefix, "pipx_metadata.json").exists():
        return f"pipx inject --force armtempo {package}"
    if Path(sys.prefix, "uv-receipt.toml").exists():
        return "uv tool upgrade armtempo"
    return f"pip install --upgrade {package}"
