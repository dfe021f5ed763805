"""The installed version of armtempo, and the command that adds a package to this installation."""

from __future__ import annotations

import os
import sys


def command(package: str, extra: str) -> str:
    """The command that adds ``package``, or armtempo's ``extra`` with it, to this installation."""
    if os.path.exists(os.path.join(sys.prefix, "pipx_metadata.json")):
        return f"pipx inject armtempo {package}"
    if os.path.exists(os.path.join(sys.prefix, "uv-receipt.toml")):
        return f"uv tool install 'armtempo[{extra}]'"
    return f"pip install 'armtempo[{extra}]'"


def upgrade(package: str) -> str:
    """The command that updates a package of this installation."""
    if os.path.exists(os.path.join(sys.prefix, "pipx_metadata.json")):
        return f"pipx inject --force armtempo {package}"
    if os.path.exists(os.path.join(sys.prefix, "uv-receipt.toml")):
        return "uv tool upgrade armtempo"
    return f"pip install --upgrade {package}"


def installed_version() -> str:
    """Such as ``"0.2.0"``; ``"0+unknown"`` in a folder that was never installed."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("armtempo")
    except PackageNotFoundError:
        return "0+unknown"
