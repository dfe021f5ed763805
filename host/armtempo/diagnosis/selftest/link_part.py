"""The link: round trips, damaged messages, bytes per second in both directions."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from armtempo_shared import wire

from armtempo.diagnosis.selftest.result import Measurement, judged
from armtempo.link import Client

PART = "link"
_COMMANDS = 10_000
_SIMULATED_COMMANDS = 20
_WORST_MS = 250.0
_LEAST_KB_S = 10.0
_CABLE = "try another cable and another USB socket, without a hub"


def trips(client: Client) -> dict[str, Any]:
    """Round-trip times of ``status``, ms; in the second half each is preceded by a damaged message.

    The board must ignore those, and answer each command.
    """
    took_ms = []
    bad_before = client.status().frames_bad
    random = np.random.default_rng(29)
    commands = _SIMULATED_COMMANDS if client.info.virtual else _COMMANDS
    for number in range(commands):
        if number >= commands // 2:
            with client.session.lock:
                client.session.transport.write(_damaged(random))
        begin_s = time.perf_counter()
        client.status()
        took_ms.append(1000 * (time.perf_counter() - begin_s))
    clean = took_ms[: commands // 2]
    return {
        "median_ms": round(float(np.median(clean)), 3),
        "worst_ms": round(max(clean), 3),
        "damaged_sent": commands - len(clean),
        "damaged_noticed": client.status().frames_bad - bad_before,
        "repeats": client.session.repeats,
    }


def _damaged(random: np.random.Generator) -> bytes:
    """A frame of ``status`` with a changed byte after its length, so that its checksum is wrong."""
    frame = bytearray(wire.frame(200, wire.COMMAND["status"][1], b""))
    frame[int(random.integers(3, len(frame)))] ^= 0x10
    return bytes(frame)


def judge(found: dict[str, Any], simulated: bool) -> Iterator[Measurement]:
    """Lines about ``found`` of ``trips`` and ``Prompt.rates``; times of a virtual board depend on the host's load."""
    yield judged(
        PART,
        "round trip of a command",
        f"{found['median_ms']:.1f} ms, worst {found['worst_ms']:.1f}",
        f"worst below {_WORST_MS:.0f} ms",
        simulated or found["worst_ms"] < _WORST_MS,
        _CABLE,
    )
    yield judged(
        PART,
        "damaged messages noticed",
        f"{found['damaged_noticed']} of {found['damaged_sent']}",
        "all, and each command answered",
        found["damaged_noticed"] >= found["damaged_sent"],
        "bring host and board to the same version: 'armtempo flash', 'armtempo deploy'",
    )
    for name, words in (("down_kb_s", "board to host"), ("up_kb_s", "host to board")):
        yield judged(
            PART,
            words,
            f"{found[name]:.0f} kB/s",
            f"{_LEAST_KB_S:.0f} kB/s or more",
            simulated or found[name] >= _LEAST_KB_S,
            _CABLE,
        )
