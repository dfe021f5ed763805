"""Whole virtual boards in one process with a scripted host and world: see ``scripts/rigs/whole_board.py``."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from armtempo import plan_sequence
from armtempo.deploy import program_files
from armtempo.encoding import encode, encoded_plan, encoded_program
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.parts import Limits, LimitSwitches
from armtempo.model.sequence import Sequence
from armtempo.model.user_program import UserProgram
from armtempo.planning import planner
from armtempo_shared.limits import TICK_HZ

from tests import interpreters, scripted
from tests.system import sequences

CASES = Path(__file__).parent / "scripts" / "cases"
SCRIPTS = [CASES / f"{name}.py" for name in ("standalone", "faults", "prompt", "sequences")]
PROGRAM = f"{interpreters.ROOT / 'board'}:{interpreters.ROOT / 'shared'}"
ARM = Arm.paper()
HOME_DEG = np.array(ARM.home_deg)
HOME_STEPS = [round(angle * joint.steps_per_deg) for angle, joint in zip(HOME_DEG, ARM.driven, strict=True)]
AWAY_DEG = ([3.0, 2.0, -2.0], [-1.0, 1.0, 2.0])
PICK = f"""from armtempo_board import cell
cell.goto({(HOME_DEG + 1.0).tolist()})
print("first\\nsecond")
while True:
    cell.sleep(1)
"""
ALONE = f"""from armtempo_board import cell
cell.home()
print("homed")
cell.goto({(HOME_DEG + 1.0).tolist()})
"""
BY_GOTO = """from armtempo_board import cell
tray = cell.pallet("tray")
while tray.left():
    place = tray.next()
    cell.goto(place.above)
    cell.goto(place)
    cell.goto(place.above)
cell.goto("home")
"""
LINES = """name = "lines"
start = "home"
[[step]]
repeat = "tray"
[[step]]
place = "tray"
[[step]]
leave = "tray"
[[step]]
end = "repeat"
[[step]]
goto = "home"
"""
FEWER = {"micropython": 8, "cpython": 10, "micropython-arm": 12}
"""What the moments are divided by; each interpreter has others."""
QUICKEST = "micropython" if "micropython" in interpreters.AVAILABLE else "cpython"


def is_for(case: scripted.Case, tag: str) -> bool:
    """Whether a comment says so of the case."""
    return tag in scripted.tags(case.script)[case.name]


ALL = scripted.cases(*SCRIPTS)
ON_SOURCES = [
    case
    for case in ALL
    if case.interpreter != "micropython" or is_for(case, "not compiled") or not is_for(case, "not on CPython")
]
"""What MicroPython runs with the sources themselves: what reaches into the program by the names in them or needs what
compiled files are without, and what CPython runs too; with the core, which is deployed, it runs all others."""


def is_again(case: scripted.Case) -> bool:
    """Whether it is run with the core, too."""
    return case.interpreter != QUICKEST and not is_for(case, "not compiled")


CORE = [case for case in ALL if case.interpreter == QUICKEST and not is_for(case, "not compiled")]


@pytest.fixture(scope="session")
def flashes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Flashes of boards for the shipped arm, ``finish`` and ``stop`` being what it does without its host.

    ``broken`` has a main.py that raises. ``go`` leaves home with all joints, turns, and comes back in about
    2.3 s; how long exactly is in ``ticks``. ``pick`` is a program: it moves, prints, and waits.
    """
    folder = tmp_path_factory.mktemp("flashes")
    postures = (HOME_DEG, *(HOME_DEG + np.array(away) for away in AWAY_DEG), HOME_DEG)
    job = Job(
        "go",
        tuple(tuple(map(float, posture)) for posture in postures),
        population=5,
        iterations=20,
        path="through",
    )
    trajectory = planner.plan(ARM, job).trajectory
    for name in ("finish", "stop"):
        arm = replace(ARM, safety=replace(ARM.safety, on_link_loss=name))
        (folder / name / "armtempo").mkdir(parents=True)
        (folder / name / "armtempo" / "arm.ata").write_bytes(encode.arm_record(arm))
        (folder / name / "armtempo" / "go.atm").write_bytes(encoded_plan.of_trajectory(trajectory, arm).data)
        (folder / "pick.py").write_text(PICK)
        program = encoded_program.of_program(UserProgram.load(folder / "pick.py", arm), arm)
        (folder / name / "armtempo" / "pick.atm").write_bytes(program.data)
    _add_legs(folder / "legs" / "armtempo")
    _add_alone(folder / "alone" / "armtempo")
    _add_pallet(folder / "pallet")
    (folder / "ticks").write_text(str(round(trajectory.duration_s * TICK_HZ)))
    shutil.copytree(folder / "finish", folder / "broken")
    (folder / "broken" / "main.py").write_text("raise ValueError('broken')\n")
    return folder


def _add_alone(folder: Path) -> None:
    """A flash of an arm that homes itself at power-up: joint 2 first, then the others together.

    Its switches trip half a degree within the low ends of narrow ranges around home, and it is quick.
    """
    folder.mkdir(parents=True)
    joints = []
    for number, joint in enumerate(ARM.joints, 1):
        if joint.motor and joint.limits and joint.encoder:
            low, high = joint.home_deg - 2.0, joint.home_deg + 4.0
            joint = replace(
                joint,
                range_deg=(low, high),
                limits=Limits(*(30.0 * each for each in joint.limits.values)),
                switches=LimitSwitches(low=number, low_deg=low + 0.5),
                encoder=None,
            )
        joints.append(joint)
    safety = replace(ARM.safety, estop_fitted=True, at_power_up="program")
    names = [joint.name for joint in joints]
    arm = replace(ARM, joints=tuple(joints), safety=safety, homing=((names[1],), (names[0], names[2])))
    (folder / "arm.ata").write_bytes(encode.arm_record(arm))
    (folder / "alone.py").write_text(ALONE)
    program = encoded_program.of_program(UserProgram.load(folder / "alone.py", arm), arm)
    (folder / "alone.atm").write_bytes(program.data)
    (folder / "default.txt").write_text(f"alone {program.data[-4:].hex()}\n")
    low = [round((joint.range_deg[0] + 0.5) * joint.steps_per_deg) for joint in arm.driven]
    (folder.parent / "trips").write_text(",".join(map(str, low)))


def _add_pallet(folder: Path) -> None:
    """A flash of an arm with a pallet of two places; ``by-goto``, a program, and ``lines``, a sequence, go to both.

    ``places`` has the steps above each place and at it.
    """
    store = folder / "armtempo"
    store.mkdir(parents=True)
    quick = tuple(
        replace(joint, limits=Limits(*(30.0 * each for each in joint.limits.values)))
        if joint.limits
        else joint
        for joint in sequences.SHIPPED.joints
    )
    (tray,) = sequences.SHIPPED.pallets
    arm = replace(sequences.SHIPPED, joints=quick, pallets=(replace(tray, rows=1, columns=2),))
    (store / "arm.ata").write_bytes(encode.arm_record(arm))
    for name, text in (("by-goto.py", BY_GOTO), ("lines.toml", LINES)):
        (folder / name).write_text(text)
    program = UserProgram.load(folder / "by-goto.py", arm)
    plan = plan_sequence(arm, Sequence.load(folder / "lines.toml", arm))
    records = (
        *encoded_program.of_program(program, arm).records,
        *encoded_plan.of_plan(plan).records,
    )
    for name, data in records:
        (store / f"{name}.atm").write_bytes(data)
    places = encoded_program.rows(arm, encoded_program.places_of(arm, program))
    (folder / "places").write_text("\n".join(",".join(map(str, place)) for place in places))


def _add_legs(folder: Path) -> None:
    """A flash with short motions from each of three postures to each other, "leg0", …; one lies between two steps."""
    folder.mkdir(parents=True)
    arm = replace(ARM, safety=replace(ARM.safety, estop_fitted=True))
    (folder / "arm.ata").write_bytes(encode.arm_record(arm))
    half_a_step_deg = [0.5 / joint.steps_per_deg for joint in ARM.driven]
    postures = (HOME_DEG, HOME_DEG + np.array([0.7, -0.4, 0.5]), HOME_DEG + np.array([-0.5, 0.3, 0.8]))
    postures[1][1] = (round(postures[1][1] / half_a_step_deg[1]) | 1) * half_a_step_deg[1]
    ways = [(one, other) for one in postures for other in postures if one is not other]
    for number, way in enumerate(ways):
        job = Job(
            f"leg{number}",
            tuple(tuple(map(float, end)) for end in way),
            population=5,
            iterations=20,
            path="through",
        )
        record = encoded_plan.of_trajectory(planner.plan(arm, job).trajectory, arm)
        (folder / f"leg{number}.atm").write_bytes(record.data)


@pytest.fixture(scope="session")
def core(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The folder of the program as ``armtempo deploy`` compiles it."""
    folder = tmp_path_factory.mktemp("core")
    texts = program_files.core()
    for name in program_files.modules():
        if (module := program_files.dotted(name)) in texts:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(texts[module])
    for path, data in program_files.start_files().items():
        (folder / program_files.PACKAGES[0] / Path(path).name).write_bytes(data)
    return str(folder)


def play(case: scripted.Case, flashes: Path, tmp_path: Path, program: str = PROGRAM) -> None:
    copied = shutil.copytree(flashes, tmp_path / "flashes")
    home = ",".join(map(str, HOME_STEPS))
    case.run(str(copied), program, home, str(FEWER[case.interpreter]))


@pytest.mark.long
@scripted.each(case for case in ON_SOURCES if is_again(case))
def test_case_again(case: scripted.Case, flashes: Path, tmp_path: Path) -> None:
    play(case, flashes, tmp_path)


@scripted.each(case for case in ON_SOURCES if not is_again(case))
def test_case(case: scripted.Case, flashes: Path, tmp_path: Path) -> None:
    play(case, flashes, tmp_path)


@pytest.mark.long
@scripted.each(CORE)
def test_case_with_the_core(case: scripted.Case, flashes: Path, core: str, tmp_path: Path) -> None:
    play(case, flashes, tmp_path, core)


@pytest.mark.long
@pytest.mark.seeds(20268)
def test_every_motion_of_a_soak_makes_the_steps_of_its_record(seed: int, tmp_path: Path) -> None:
    sequences.make_flash(tmp_path / "flash")
    print(sequences.soak(QUICKEST, tmp_path / "flash", 10, seed))
