"""Names of an arm file: what uses them, giving another one, removing; everything else stays as it is written."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
from armtempo.basics import atomic_file
from armtempo.basics.errors import InputError
from armtempo.model import arm_names, shipped
from armtempo.model.arm import Arm

TABLES = """
# where the tray stands
[frame.tray]  # mine
position_mm = [250, 0, 20]
# measured in May

# the bin is beside it
[frame.bin]
frame = "tray"  # of the tray
position_mm = [0, 100, 0]

[posture.away] # up
angles_deg = [0, 0, 0, 0, 10, 0]

# a pen
[tool.pen]
position_mm = [10, 0, 120]
"""
JOB = 'name = "feed"\ntool = "pen"\n[[via]]\nposition_mm = [260, 100, 220]\nframe = "tray"\n[[via]]\nposture = "away"\n'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    made = tmp_path / "arm.toml"
    made.write_bytes((shipped.files()["ar4"].read_text(encoding="utf-8") + TABLES).encode())
    (tmp_path / "feed.toml").write_text(JOB)
    (tmp_path / "day.toml").write_text('name = "day"\n[[step]]\ngoto = "away"\n[[step]]\ntool = "pen"\n')
    (tmp_path / "turn.py").write_text('# with the pen\ncell.tool("pen")\n')
    (tmp_path / "broken.toml").write_text('frame = "tray"\n[')
    return made


def test_what_uses_a_name_is_told(file: Path) -> None:
    (file.parent / "other.toml").write_text(file.read_text(encoding="utf-8"))  # an arm with names of its own
    row = file.read_text(encoding="utf-8").splitlines().index('frame = "tray"  # of the tray') + 1
    expected = {
        ("frame", "tray"): [
            ("arm.toml", row, True),
            ("broken.toml", 1, False),
            ("feed.toml", 5, True),
        ],
        ("frame", "bin"): [],
        ("tool", "pen"): [("day.toml", 5, True), ("feed.toml", 2, True), ("turn.py", 2, False)],
        ("posture", "away"): [("day.toml", 3, True), ("feed.toml", 7, True)],
    }
    for place, lines in expected.items():
        found = arm_names.uses_in_files(file, file.parent, *place)
        assert [(use.file.name, use.line, use.follows) for use in found] == lines
    assert found[0].text == 'goto = "away"'


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_another_name_is_given_where_the_file_uses_it(file: Path, end: str) -> None:
    text = file.read_text(encoding="utf-8").replace("\n", end)
    file.write_bytes(b"\xef\xbb\xbf" + text.encode())
    arm = arm_names.rename(file, "frame", "tray", "plate")
    expected = text.replace("[frame.tray]", "[frame.plate]").replace('frame = "tray"', 'frame = "plate"')
    assert file.read_bytes() == b"\xef\xbb\xbf" + expected.encode()
    assert [one.name for one in arm.frames] == ["plate", "bin"]
    assert Arm.load(file).frames == arm.frames
    arm_names.rename(file, "tool", "pen", "brush")
    arm_names.rename(file, "posture", "away", "up")
    expected = expected.replace("[tool.pen]", "[tool.brush]").replace("[posture.away]", "[posture.up]")
    assert file.read_bytes() == b"\xef\xbb\xbf" + expected.encode()


def test_a_sequence_begins_at_a_posture_too_and_may_be_of_another_arm(file: Path) -> None:
    folder, text = (
        file.parent,
        'name = "night"\nstart = "away"\n[posture.low]\nangles_deg = [0, 0, 0, 0, 0, 0]\n',
    )
    (folder / "night.toml").write_text(text)
    (folder / "others.toml").write_text('arm = "scara"\n' + text)
    (folder / "mine.toml").write_text('arm = "arm.toml"\n' + text)
    found = arm_names.uses_in_files(file, folder, "posture", "away")
    assert [(use.file.name, use.line) for use in found if use.file.name[0] in "nom"] == [
        ("mine.toml", 3),
        ("night.toml", 2),
    ]
    with pytest.raises(InputError, match=r"mine\.toml has a posture 'low' of its own"):
        arm_names.rename(file, "posture", "away", "low", folder)
    arm_names.rename(file, "posture", "away", "up", folder)
    assert 'start = "up"' in (folder / "night.toml").read_text()
    assert 'start = "away"' in (folder / "others.toml").read_text()


def _contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_jobs_and_sequences_follow_and_keep_their_comments(file: Path) -> None:
    (file.parent / "feed.toml").write_bytes(
        JOB.replace('"pen"', "'pen'  # mine").replace("\n", "\r\n").encode()
    )
    (file.parent / "other.toml").write_text(file.read_text(encoding="utf-8"))
    before = _contents(file.parent)
    arm_names.rename(file, "tool", "pen", "brush", file.parent)
    assert _contents(file.parent) == before | {
        "arm.toml": before["arm.toml"].replace(b"[tool.pen]", b"[tool.brush]"),
        "feed.toml": before["feed.toml"].replace(b"'pen'  # mine", b'"brush"  # mine'),
        "day.toml": before["day.toml"].replace(b'"pen"', b'"brush"'),
    }


@pytest.mark.parametrize("fails_at", range(3))
def test_all_files_are_written_or_none(file: Path, monkeypatch: pytest.MonkeyPatch, fails_at: int) -> None:
    """The disk fails at one of the files, before or after others were replaced."""
    before = _contents(file.parent)
    replaced: list[object] = []

    def replace(source: Path, target: Path) -> None:
        replaced.append(target)
        if len(replaced) == fails_at + 1:
            raise OSError(errno.EIO, "Input/output error")
        os.rename(source, target)

    with monkeypatch.context() as patched:
        patched.setattr(atomic_file.os, "replace", replace)
        with pytest.raises(InputError, match=r"cannot be written: Input/output error; no file was changed"):
            arm_names.rename(file, "tool", "pen", "brush", file.parent)
    assert _contents(file.parent) == before
    assert len(replaced) == 2 * fails_at + 1  # those that were replaced went back


@pytest.mark.parametrize(
    ("kind", "name", "new", "problem"),
    [
        ("frame", "tray", "bin", "there is a frame 'bin' already"),
        ("frame", "tray", "base", "is the frame of the arm itself"),
        ("tool", "pen", "nothing", "means no tool"),
        ("posture", "away", "home", "home_deg"),
        ("posture", "away", "P1", "via point"),
        ("posture", "away", "it's", "not a valid name"),
    ],
)
def test_a_name_that_is_not_possible_is_refused(
    file: Path, kind: str, name: str, new: str, problem: str
) -> None:
    before = file.read_bytes()
    with pytest.raises(InputError, match=problem):
        arm_names.rename(file, kind, name, new)
    assert file.read_bytes() == before


def test_what_is_removed_goes_with_its_comments_alone(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    with pytest.raises(InputError, match=r"frame\.bin\.frame: uses the frame 'tray'"):
        arm_names.remove(file, "frame", "tray")
    assert file.read_text(encoding="utf-8") == text
    arm = arm_names.remove(file, "posture", "away")
    assert not arm.postures
    assert file.read_text(encoding="utf-8") == text.replace(
        "[posture.away] # up\nangles_deg = [0, 0, 0, 0, 10, 0]\n\n", ""
    )
    arm_names.remove(file, "frame", "bin")
    assert not arm_names.remove(file, "frame", "tray").frames
    assert file.read_text(encoding="utf-8").endswith("# a pen\n[tool.pen]\nposition_mm = [10, 0, 120]\n")
    assert "# the bin is" not in file.read_text(encoding="utf-8")


def test_what_is_written_otherwise_is_refused(file: Path) -> None:
    text = file.read_text(encoding="utf-8").replace("[tool.pen]\n", "[tool]\npen.")
    file.write_text(text, encoding="utf-8")
    for call in (
        lambda: arm_names.remove(file, "tool", "pen"),
        lambda: arm_names.rename(file, "tool", "pen", "nib"),
    ):
        with pytest.raises(InputError, match="cannot be changed here"):
            call()
    assert file.read_text(encoding="utf-8") == text
