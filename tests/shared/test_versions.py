"""Versions of formats: a layout that changes gets another one, so that nothing is taken for something else."""

from __future__ import annotations

from armtempo.model import arm_json, sequence_plan
from armtempo.model import plan as plan_file
from armtempo.ports import claim_file
from armtempo.runs import run_folder, sequence_folder
from armtempo_shared import armrecord, messages, wire

from tests.shared import stored_bytes


def test_versions_are_those_of_files_that_exist() -> None:
    versions = {
        "arm": arm_json.VERSION,
        "trajectory": plan_file.VERSION,
        "sequence": sequence_plan.VERSION,
        "run": run_folder.VERSION,
        "sequence run": sequence_folder.VERSION,
        "claim": claim_file.VERSION,
        "arm record": armrecord.VERSION,
        "protocol": messages.PROTOCOL_VERSION,
    }
    assert versions == {
        "arm": 1,
        "trajectory": 2,
        "sequence": 2,
        "run": 1,
        "sequence run": 1,
        "claim": 1,
        "arm record": 2,
        "protocol": 5,
    }


# a layout that changes gets another version: what an older program wrote is not taken for something else


def test_each_version_has_the_bytes_that_it_had() -> None:
    kept = stored_bytes.kept()
    for name, made in stored_bytes.layouts().items():
        assert name in kept, f"{name} is new: 'python -m tests.shared.stored_bytes' keeps its bytes"
        assert made == kept[name], f"{name}: another layout needs another version"


def test_no_message_is_dropped_under_the_same_version() -> None:
    version = f"protocol {wire.PROTOCOL_VERSION}, "
    assert {name for name in stored_bytes.kept() if name.startswith(version)} <= stored_bytes.layouts().keys()
