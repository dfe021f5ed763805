"""The installed version of armtempo, and the command that adds a package to this installation."""

from __future__ import annotations

import os
import re
import shlex
import sys


def command(package: str, extra: str) -> str:
    """The command that adds the packages of armtempo's ``extra``, ``package`` among them, to this installation.

    It names the packages, as an installation from a checkout or a wheel finds no "armtempo[extra]" in an index.
    """
    packages = shlex.join(_packages(extra) or [package])
    if os.path.exists(os.path.join(sys.prefix, "pipx_metadata.json")):
        return f"pipx inject armtempo {packages}"
    if os.path.exists(os.path.join(sys.prefix, "uv-receipt.toml")):
        return f"uv pip install --python {shlex.quote(sys.prefix)} {packages}"
    return f"pip install {packages}"


def _packages(extra: str) -> list[str]:
    """Packages with their versions; none if armtempo was never installed."""
    from importlib.metadata import PackageNotFoundError, requires

    try:
        lines = requires("armtempo") or []
    except PackageNotFoundError:
        return []
    wanted = re.compile(rf"(\S+) ?;.*\bextra == ['\"]{extra}['\"]")
    return [found[1] for line in lines if (found := wanted.match(line))]


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
