"""A layout that changes gets another version: what an older program wrote is not taken for something else."""

from __future__ import annotations

from armtempo_shared import wire

from tests.shared import stored_bytes


def test_each_version_has_the_bytes_that_it_had() -> None:
    kept = stored_bytes.kept()
    for name, made in stored_bytes.layouts().items():
        assert name in kept, f"{name} is new: 'python -m tests.shared.stored_bytes' keeps its bytes"
        assert made == kept[name], f"{name}: another layout needs another version"


def test_no_message_is_dropped_under_the_same_version() -> None:
    version = f"protocol {wire.PROTOCOL_VERSION}, "
    assert {name for name in stored_bytes.kept() if name.startswith(version)} <= stored_bytes.layouts().keys()
