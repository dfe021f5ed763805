"""Bytes of every layout that something else may have written, kept for each of its versions in ``stored_bytes.json``.

    python -m tests.shared.stored_bytes

adds those of a new version, or of a new message. What is kept is never changed: another layout needs another version.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zlib import crc32

from armtempo.link.board_messages import Positions, Sample
from armtempo.report import run_folder
from armtempo_shared import armrecord, motion, sequence, way_back, wire

RAMPS = tuple(range(1000, 65000, 1000)), tuple(range(1, 33)), 14, 0
NAMED = {"engine_bytes": "engine_room"}
"""Fields by the names that their numbers follow from: those they had when their bytes were kept."""
KEPT = Path(__file__).with_name("stored_bytes.json")


def layouts() -> dict[str, str]:
    """What each layout of today makes of numbers that follow from the fields' names; bytes as hex, text unchanged."""
    return {name: made for part in (_records, _messages, _run_folder) for name, made in part()}


def _number(name: str, kind: str) -> int:
    return crc32(NAMED.get(name, name).encode()) % (
        1 << {"B": 8, "H": 16, "I": 32, "i": 31, "q": 63, "Q": 64}[kind]
    )


def _fields(table: tuple[tuple[str, str], ...], prefix: str = "") -> dict[str, int]:
    return {name: _number(prefix + name, kind) for name, kind in table}


def _records() -> Iterator[tuple[str, str]]:
    head = _fields(armrecord.HEAD)
    rows = [_fields(armrecord.JOINT), _fields(armrecord.JOINT, "second ")]
    wired = [[_fields(table)] for table in (armrecord.OUTPUT, armrecord.INPUT)]
    for outputs in ([], wired):
        record = armrecord.pack(head, rows, *outputs)
        yield f"arm record, version {record[4]}", record.hex()
    for axes in (1, 2):
        times = [[100 * (axis + 1) + place for place in range(5)] for axis in range(axes)]
        record = motion.pack(3, [[1, 2, 3, 4, 5], [6, 7, 8, 9, 10]], times, 1, RAMPS, 12)
        yield f"motion record {record[:4].decode()}, time axes {axes}", record.hex()
        back = way_back.pack(record, "feed", (*RAMPS[:3], 3))
        yield f"record of the way back {back[:4].decode()}, time axes {axes}", back.hex()
    close = motion.pack(3, [[1, 2, 3, 4, 5]], [[100, 101, 102, 103, 104]], 1, (*RAMPS[:3], 3), 12)
    yield f"motion record {close[:4].decode()}, entries close at the ends", close.hex()
    record = sequence.pack(1, [(2, 3, 4, 5, 6), (7, 8, 9, 10, 11)], [("ä", 12)], ["b"])
    yield f"sequence record {record[:4].decode()}", record.hex()


def _messages() -> Iterator[tuple[str, str]]:
    tails = {"": b"", "text": "naïve", "bytes": b"\xff\x00"}
    for kind, table in (("command", wire.COMMAND), ("answer", wire.ANSWER), ("event", wire.EVENT)):
        for name, entry in table.items():
            values = [_number(*field) for field in zip(entry[3], entry[2][1:], strict=True)]
            payload = wire.encode(entry, values, tails[entry[4]])
            frame = wire.frame(7, entry[1], payload).hex()
            yield f"protocol {wire.PROTOCOL_VERSION}, {kind} {name}", frame


def _run_folder() -> Iterator[tuple[str, str]]:
    joints = (run_folder.JointScale("joint 1", 35.5, 11.25), run_folder.JointScale("joint 2", 2.0, 0.0))
    positions = Positions((8, 9), (10, 0))
    sample = Sample(run=1, index=2, ticks=84_000_003, path_ticks=84_000_002, flags=0, positions=positions)
    with TemporaryDirectory() as name:
        folder = run_folder.RunFolder(
            Path(name), "feed", joints, {"port": "sim"}, "2030-01-02T03:04:05+00:00"
        )
        with folder.begin_repetition() as file:
            file.append(sample)
            file.repetition.end(run_folder.COMPLETE, "", sample.ticks, positions, ())
        for path in sorted(Path(name).iterdir()):
            text = path.read_text(encoding="utf-8")
            if path.name == run_folder.META:
                meta: dict[str, Any] = json.loads(text)
                assert text == json.dumps(meta, indent=2, ensure_ascii=False) + "\n"
                text = json.dumps({**meta, "armtempo": "", "written": ""}, ensure_ascii=False)
            yield f"run folder, version {run_folder.VERSION}, {path.name}", text


def kept() -> dict[str, str]:
    """By layout and version."""
    found: dict[str, str] = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    return found


if __name__ == "__main__":
    text = json.dumps({**layouts(), **kept()}, indent=1, ensure_ascii=False)
    KEPT.write_text(text + "\n", encoding="utf-8")
