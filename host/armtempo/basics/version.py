"""The version of armtempo that is installed."""

from __future__ import annotations

from functools import cache


@cache
def installed_version() -> str:
    """Such as ``"0.2.0"``; ``"0+unknown"`` in a folder that was never installed."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("armtempo")
    except PackageNotFoundError:
        return "0+unknown"
