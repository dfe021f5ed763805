"""Arm files with something changed, and ``armtempo check`` on them."""

from __future__ import annotations

from pathlib import Path

from armtempo.cli import main
from armtempo.model import shipped
from armtempo.model.arm import Arm
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


GRIPPER = """
[output.gripper]
kind = "servo"
pin = "PB8"
pulse_us = [500, 2500]
angles_deg = [0, 180]
states = { open = 20.0, closed = 95.0 }
safe = "open"
"""
PUMP = '\n[output.pump]\nkind = "switch"\npin = "PD0"\nactive = "low"\n'
FAN = '\n[output.fan]\nkind = "pwm"\npin = "PB9"\nfrequency_hz = 20000\nstates = { slow = 0.25 }\n'
PART = '\n[input.part]\npin = "PD1"\n'
DOOR = '\n[input.door]\npin = "PD3"\nactive = "high"\ndebounce_ms = 0\n'
ALL = GRIPPER + PUMP + FAN + PART + DOOR


def write(folder: Path, *tables: str, board: str = "") -> Path:
    """The shipped arm's file with these tables after it."""
    path = folder / "wired.toml"
    text = shipped.arm_path().read_text(encoding="utf-8")
    path.write_text(f'board = "{board}"\n{text}' if board else text, encoding="utf-8")
    path.write_text(path.read_text(encoding="utf-8") + "".join(tables), encoding="utf-8")
    return path


def load(folder: Path, *tables: str, board: str = "") -> Arm:
    """The same, read."""
    return Arm.load(write(folder, *tables, board=board))
