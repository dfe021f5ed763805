"""The board and the arm for ``output`` and ``input``, directly or through the program that has the port."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from armtempo.basics.errors import LinkError
from armtempo.cli import chosen
from armtempo.link.board_messages import Levels
from armtempo.model.arm import Arm
from armtempo.robot.outputs import Way
from armtempo.robot.shared_board import SharedBoard


@dataclass(frozen=True)
class Wired:
    """The way to a board that is set up for ``arm``."""

    way: Way
    arm: Arm

    def levels(self) -> Levels:
        """What the board says."""
        return self.way.levels()


@contextmanager
def board(port: str | None, arm_path: Path | None, log_traffic: Path | None) -> Iterator[Wired]:
    """Raises LinkError where the board is set up for another arm than the one that is named."""
    name = chosen.port(port, others=True)
    named = chosen.named_arm(arm_path)
    with chosen.shared_or_own(name, log_traffic, named) as found:
        if isinstance(found, SharedBoard):
            yield Wired(found, _same_arm(found.state().arm_crc, named))
            return
        arm = chosen.arm_of_board(found, named)
        found.configure(arm)
        yield Wired(found.client, arm)


def _same_arm(arm_crc: int, named: Arm | None) -> Arm:
    from armtempo.robot.board_state import record_crc

    arm = named or Arm.paper()
    if record_crc(arm) != arm_crc:
        raise LinkError(
            f"the board is set up for another arm than {chosen.words(arm)}", "name that arm's file with --arm"
        )
    return arm
