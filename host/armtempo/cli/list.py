"""``armtempo list``: what the board keeps."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from armtempo.cli import options

if TYPE_CHECKING:
    from armtempo.link.board_messages import StoredMotion


@click.command()
@options.port
@options.log_traffic
def command(port: str, log_traffic: Path | None) -> None:
    """List the motions on the board.

    The one marked * is what the board's button starts.
    """
    with options.board(port, log_traffic) as board:
        found = board.list()
    click.echo(f"{'name':<26}{'bytes':>8}{'joints':>8}{'seconds':>10}  checksum")
    for entry in found:
        click.echo(_line(entry))


def _line(entry: StoredMotion) -> str:
    name = entry.name + (" *" if entry.default else "")
    if not entry.joints:
        return f"{name:<26}{entry.size:>8}  damaged; upload it again or remove it"
    return f"{name:<26}{entry.size:>8}{entry.joints:>8}{entry.duration_s:>10.3f}  {entry.crc:08x}"
