"""Files and boards that are out there: the number of a format changes only together with what is in it."""

from __future__ import annotations

from armtempo.model import arm_json, sequence_plan
from armtempo.model import plan as plan_file
from armtempo.ports import claim_file
from armtempo.runs import run_folder, sequence_folder
from armtempo_shared import armrecord, messages


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
        "protocol": 4,
    }
