"""The board's channels for motors and encoders, by the joints that use them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import NamedTuple

from armtempo.model.parts import Joint


class SharedChannel(NamedTuple):
    """A channel of the board used by more than one joint."""

    key: str
    """``"motor"`` or ``"encoder"``."""
    channel: int
    joints: tuple[str, ...]


def shared(joints: Iterable[Joint]) -> list[SharedChannel]:
    """Channels used by more than one joint; empty for those of a valid arm."""
    users: dict[tuple[str, int], list[str]] = defaultdict(list)
    for joint in joints:
        for key, part in (("motor", joint.motor), ("encoder", joint.encoder)):
            if part is not None:
                users[key, part.channel].append(joint.name)
    return [SharedChannel(*place, tuple(names)) for place, names in users.items() if len(names) > 1]
