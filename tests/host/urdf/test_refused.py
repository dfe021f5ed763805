"""What of a URDF does not fit an arm, and what is said then."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest
from armtempo.basics.errors import InputError, PlanError
from armtempo.cli import main
from armtempo.model.arm import Arm
from armtempo.new_arm import urdf_fitting as fitting
from armtempo.new_arm import urdf_reader as reader
from armtempo.new_arm import urdf_rows as dh
from click.testing import CliRunner

from tests.host.urdf.files import FOLDER, J2_LIMIT

pytestmark = pytest.mark.slow


REFUSED = [
    ("two_ends", [], ["choose with --tip", ": tool (j1, j2, j3), l2 (j1, j2), camera (j1, j2), l1 (j1)\n"]),
    ("wheel", [], ["turning without end, as wheels do: 'wheel';"]),
    ("gripper", ["--tip", "right_finger"], ["joint 'right': it mimics 'left'"]),
    ("gripper", ["--tip", "thumb"], ["has no link 'thumb' for --tip", "left_finger"]),
    ("gripper", ["--base", "hand", "--tip", "l1"], ["no chain leads from link 'hand' to 'l1'"]),
    ("gripper", ["--base", "hand", "--tip", "hand"], ["the same link"]),
    ("four_skew", ["--tip", "base"], ["no joint between 'world' and 'base' turns"]),
    ("no_limits", [], ["joint 'j2': it has no limits", "<limit lower="]),
    ("broken", [], ["not valid XML", "line"]),
    ("xacro", [], ["make a URDF of it first: xacro"]),
    ("optenv", [], ["'$(optenv LENGTH 0.3) 0 0' still to be filled in", "make a URDF of it first: xacro"]),
    (
        "does_not_fit",
        [],
        [
            "joint 'copy': it mimics 'turn'",
            "joint 'float': it is free",
            "joint 'glide': it moves in a plane",
            "joint 'backwards': its limits 2 to -2 rad are no range",
            "joint 'aimless': its axis has no direction",
            "choose another chain with --base and --tip",
        ],
    ),
    ("is_not_there", [], ["no such file"]),
    ("light", [], ["joint 'j3': a mass"]),
    ("unit", [], ["joint 'j2': <limit> upper='2.0rad' is not a number"]),
    ("nowhere", [], ["joint 'j1': <origin> xyz='0 0 nan' is not finite"]),
    ("flat", [], ["joint 'j1': <axis> xyz='0 1' is not 3 numbers"]),
    ("backwards", [], ["joint 'j2': <limit> velocity='-1.5' is below 0"]),
    ("massless", [], ["link 'tool': <mass> value='nan' is not finite"]),
    ("long", [], ["joint[1].a_mm = 2500000.0 is not allowed"]),
]


TOOL = '<link name="tool"/>'
SPOILED = {
    "broken": lambda text: text[: text.index(J2_LIMIT)],
    "no_limits": lambda text: text.replace(J2_LIMIT, ""),
    "optenv": lambda text: text.replace('"0 0 0.08"', '"$(optenv LENGTH 0.3) 0 0"'),
    "light": lambda text: text.replace(
        TOOL, TOOL.replace("/>", ">") + '<inertial><mass value="-1"/></inertial></link>'
    ),
    "unit": lambda text: text.replace(J2_LIMIT, J2_LIMIT.replace('"2.0"', '"2.0rad"')),
    "nowhere": lambda text: text.replace('"0 0 0.08"', '"0 0 nan"'),
    "flat": lambda text: text.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 1"/>'),
    "backwards": lambda text: text.replace(J2_LIMIT, J2_LIMIT.replace('"1.5"', '"-1.5"')),
    "massless": lambda text: text.replace(
        TOOL, TOOL.replace("/>", ">") + '<inertial><mass value="nan"/></inertial></link>'
    ),
    "long": lambda text: text.replace("0.25 0 0.02", "2500 0 0"),
    "xacro": lambda text: text.replace("<link", '<xacro:property name="a" value="1"/>\n  <link', 1).replace(
        "<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"'
    ),
}
"""By name: what is done to the planar arm."""


@pytest.mark.parametrize(("name", "options", "said"), REFUSED)
def test_what_does_not_fit_is_refused_with_its_reasons(
    tmp_path: Path, name: str, options: list[str], said: list[str]
) -> None:
    urdf, out = FOLDER / f"{name}.urdf", tmp_path / "arm.toml"
    if name in SPOILED:
        urdf = tmp_path / urdf.name
        urdf.write_text(SPOILED[name]((FOLDER / "three_planar.urdf").read_text()))
    result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out), *options])
    assert result.exit_code == 2
    for text in said:
        assert text in result.output
    assert not out.exists()


LINK = '<link name="a"/>'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<html/>", "not <robot>"),
        (f"<robot>{LINK}</robot>", "has no name"),
        (f'<robot name="x">{LINK}<joint name="j" type="revolute"/></robot>', "not a URDF that can be read"),
        ('<robot name="x"/>', "has no joints"),
        (f'<robot name="x">{LINK}{LINK}</robot>', "two links are called 'a'"),
        (f'<robot name="x">{LINK}</robot>', "has no joints"),
    ],
)
def test_xml_that_is_no_robot(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        reader.read(path)


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    urdf, out = tmp_path / "robot.urdf", tmp_path / "arm.toml"
    shutil.copy(FOLDER / "three_planar.urdf", urdf)
    out.write_text("mine")
    for command, kept in (([str(out)], out), ([str(urdf)], urdf), ([str(urdf), "--force"], urdf)):
        before = kept.read_bytes()
        result = CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", *command])
        assert result.exit_code == 2
        assert kept.read_bytes() == before
    assert CliRunner().invoke(main, ["import-urdf", str(urdf), "-o", str(out), "--force"]).exit_code == 0
    assert Arm.read(out).name == "three planar"


def test_without_the_extra_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "yourdfpy", None)
    result = CliRunner().invoke(
        main, ["import-urdf", str(FOLDER / "three_planar.urdf"), "-o", str(tmp_path / "a")]
    )
    assert result.exit_code == 1
    assert "pip install 'yourdfpy" in result.output


def test_a_table_that_does_not_keep_to_the_urdf_is_not_written(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    derive = dh.derive

    def wrong(*arguments: object) -> list[dh.DhRow]:
        first, *rest = derive(*arguments)  # type: ignore[arg-type]
        return [first._replace(a_mm=first.a_mm + 0.1), *rest]

    monkeypatch.setattr(dh, "derive", wrong)
    chain = reader.read(FOLDER / "three_planar.urdf")
    with pytest.raises(PlanError, match=r"off by 0\.1 mm"):
        fitting.fit(chain)
