"""Arm files with something changed, and ``armtempo check`` on them."""

from __future__ import annotations

from pathlib import Path

from armtempo.cli import main
from armtempo.model import shipped
from click.testing import CliRunner, Result


def changed(tmp_path: Path, *changes: tuple[str, str], of: str = shipped.PAPER) -> Path:
    """A shipped arm file with texts replaced, each once."""
    text = shipped.files()[of].read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "arm.toml"
    path.write_text(text)
    return path


def run_check(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["check", *map(str, arguments)])
