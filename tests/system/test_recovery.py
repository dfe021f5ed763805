"""host/docs/recovery.md: each bad state is made on the virtual board, shows its sign, and ends with the page's steps.

The commands are read from the page; each section needs a way into its state here, and has none without one.
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import indent
from typing import Any

import pytest
from armtempo.simulator import LaunchOptions, VirtualBoard, launch

from tests import interpreters
from tests.system import commandline
from tests.system.commandline import armtempo, small_plan

PAGE = (interpreters.ROOT / "host" / "docs" / "recovery.md").read_text(encoding="utf-8")
INTERPRETER = "micropython" if "micropython" in interpreters.AVAILABLE else "cpython"
HANG = "import micropython, time\nmicropython.kbd_intr(-1)\nwhile True:\n    time.sleep_ms(5)\n"
WATCHDOG = "import machine, time\nmachine.WDT(timeout=1000)\nwhile True:\n    time.sleep_ms(5)\n"
BARE = "runs MicroPython but not the armtempo program"


@dataclass(frozen=True)
class Section:
    """One bad state on the page."""

    title: str
    sign: tuple[str, str]
    """A command and what it says."""
    steps: tuple[str, ...]
    """Commands, and what is done by hand in **."""


def sections() -> list[Section]:
    """All parts of the page that have a sign."""
    found = []
    for part in PAGE.split("\n## ")[1:]:
        if "\nSign: " in part:
            title, rest = part.split("\n", 1)
            sign, steps = rest.split("\nSign: ")[1].split("\n", 1)
            match = re.fullmatch(r'`([^`]+)` says "(.+)"', sign)
            assert match, sign
            found.append(Section(title, (match[1], match[2]), tuple(_steps(steps))))
    return found


def _steps(text: str) -> list[str]:
    found = []
    for hand, block in re.findall(r"(\*\*[^*]+\*\*)|```sh\n(.*?)```", text, re.DOTALL):
        found += [hand] if hand else block.splitlines()
    return found


SECTIONS = sections()
HELD_S = {"**Safe boot**": 0.9, "**Factory reset**": 1.5}
"""How long the user button is held from power-up on."""
MPREMOTE_S = 60.0
TRIES = 4
"""If mpremote's Ctrl-C meets boot.py, that ends by it, main.py begins, and nobody answers. On a serial port mpremote
gives up after 10 s, and its user tries again; on a pseudo terminal it waits for ever."""


@dataclass
class Bench:
    """A virtual board on the table: its flash, what is done to it by hand, commands to it."""

    folder: Path
    hardware: dict[str, Any] = field(default_factory=dict)
    board: VirtualBoard | None = None

    @property
    def flash(self) -> Path:
        """The folder that is the flash."""
        return self.folder / "flash"

    def power(self, **once: Any) -> None:
        """Take the power away and give it again."""
        self.off()
        if INTERPRETER == "cpython":
            self.hardware.setdefault("flash_blocks", 600)
        starter = interpreters.starter(INTERPRETER)
        self.board = launch(
            LaunchOptions(self.flash, interpreter=starter, deployed=True, **{**self.hardware, **once})
        )

    def off(self) -> None:
        """Take the power away."""
        if self.board:
            self.board.__exit__(None, None, None)
            self.board = None

    def by_hand(self, what: str) -> None:
        """What the page says in bold."""
        if what in HELD_S:
            self.power(button_s=HELD_S[what])
        elif what == "**Take the card out**":
            self.hardware.pop("sd_card")
        elif what == "**Install MicroPython**":
            self.hardware.pop("machine")
            self.power()
        elif what == "**Reset**":
            self.power()
        else:
            assert what == "**Eject the drive**", what

    def run(self, command: str) -> tuple[int, str]:
        """Exit code and output of a command of the page."""
        assert self.board
        words = [self.board.port if word == "PORT" else word for word in shlex.split(command)]
        if words[0] == "armtempo":
            done = commandline.run(*words[1:], folder=self.folder)
            return done.exit_code, done.output + done.errors
        assert words[0] == "mpremote", command
        for _ in range(TRIES):
            with suppress(subprocess.TimeoutExpired):
                ended = commandline.python("-m", *words, cwd=self.folder, timeout=MPREMOTE_S)
                return ended.returncode, ended.stdout + ended.stderr
        raise AssertionError(f"{command}: no end within {MPREMOTE_S} s, {TRIES} times")

    def used_blocks(self) -> int:
        """Blocks of the flash that are in use; a folder's names take 32 bytes each, long ones three times as much."""
        paths = list(self.flash.rglob("*"))
        files = sum(-(-path.stat().st_size // 512) for path in paths if path.is_file())
        names = {path: [each.name for each in path.iterdir()] for path in paths if path.is_dir()}
        lengths = [
            2 + sum(1 if len(name) <= 12 and name.count(".") < 2 else 3 for name in each)
            for each in names.values()
        ]
        return files + sum(-(-length // 16) for length in lengths)


@pytest.fixture(scope="module")
def deployed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a flash that has the program, and a trajectory file."""
    folder = tmp_path_factory.mktemp("deployed")
    bench = Bench(folder)
    bench.power()
    try:
        code, output = bench.run("armtempo deploy --port PORT")
    finally:
        bench.off()
    assert code == 0, output
    small_plan(folder / "feed.json")
    return folder


@pytest.fixture
def bench(deployed: Path, tmp_path: Path) -> Any:
    """A board with the program, not powered yet."""
    shutil.copytree(deployed, tmp_path, dirs_exist_ok=True)
    found = Bench(tmp_path)
    yield found
    found.off()


# ways into the bad states


def module(bench: Bench, name: str, text: str) -> None:
    """Replace a module of the program by a source file; the whole program if it is in an archive."""
    folder = bench.flash / "lib" / "armtempo_board"
    if not folder.exists():
        folder.mkdir()
        name, text = "__init__", "def keep_watchdog_fed():\n    pass\ndef start():\n" + indent(text, "    ")
    for path in folder.glob(f"{name}.*"):
        path.unlink()
    (folder / f"{name}.py").write_text(text)


def damage_largest(bench: Bench) -> None:
    """The largest file of the program is none any more."""
    largest = max((bench.flash / "lib").rglob("*.*"), key=lambda path: path.stat().st_size)
    largest.write_bytes(b"nonsense")


def file(bench: Bench, name: str, text: str) -> None:
    (bench.flash / name).write_text(text)


def full_flash(bench: Bench) -> None:
    shutil.rmtree(bench.flash / "lib")
    (bench.flash / "data.csv").write_bytes(bytes(512 * (190 - 14)))


def full_of_motions(bench: Bench) -> None:
    bench.power()
    assert bench.board
    armtempo("upload", "feed.json", "--name", "old", "--port", bench.board.port, folder=bench.folder)
    bench.hardware["flash_blocks"] = bench.used_blocks() + 1


def card(bench: Bench) -> None:
    (bench.folder / "card").mkdir()
    (bench.folder / "card" / "main.py").write_text("print('the program on the card')\n")
    bench.hardware["sd_card"] = bench.folder / "card"


def damaged(kind: str) -> Callable[[Bench], None]:
    return lambda bench: bench.power(damage=kind)


STATES: dict[str, dict[str, Callable[[Bench], None]]] = {
    "The program does not start": {
        "damaged file": damage_largest,
        "exception in main.py": lambda bench: file(bench, "main.py", "1 / 0\n"),
        "exception in boot.py": lambda bench: file(bench, "boot.py", "1 / 0\n"),
    },
    "The board hangs": {
        "program": lambda bench: module(bench, "program", HANG),
        "watchdog": lambda bench: file(bench, "main.py", WATCHDOG),
    },
    "boot.py does not end": {"boot.py": lambda bench: file(bench, "boot.py", HANG)},
    "Another file is in the way": {"module": lambda bench: file(bench, "armtempo_board.py", "")},
    "The program is whole and does not start": {"module": lambda bench: file(bench, "armtempo_board.py", "")},
    "The flash is full": {"data": full_flash},
    "An upload finds no space": {"motion": full_of_motions},
    "The flash is empty": {"": damaged("no file system")},
    "The file system is damaged": {"": damaged("unreadable")},
    "Nothing else helps": {"hanging": lambda bench: file(bench, "main.py", HANG)},
    "An SD card is in the way": {"with a program": card},
    "An SD card is in the way and must stay": {"with a program": card},
    "The board shows itself as a drive": {"boot.py": lambda bench: file(bench, "boot.py", "# mine\n")},
    "The firmware is another": {
        "chip": lambda bench: bench.hardware.update(machine="PYBD-SF6W with STM32F767IIK")
    },
}
"""By section and name: what is done to a board with the program before it is powered, or with it."""


@pytest.mark.long
@pytest.mark.parametrize(
    ("section", "state"),
    [(section, state) for section in SECTIONS for state in STATES.get(section.title, {"missing": None})],
    ids=lambda value: value.title if isinstance(value, Section) else value,
)
def test_steps_of_the_page_lead_out(section: Section, state: str, bench: Bench) -> None:
    STATES[section.title][state](bench)
    if bench.board is None or "flash_blocks" in bench.hardware:
        bench.power()
    command, words = section.sign
    assert words in bench.run(command)[1]
    for step in section.steps:
        if step.startswith("**"):
            bench.by_hand(step)
        else:
            code, output = bench.run(step)
            assert code == 0, (step, output)
    removed = "undeploy" in section.steps[-1]
    if " deploy " not in section.steps[-1]:  # which ends by finding the program running
        code, output = bench.run("armtempo status --port PORT")
        assert (code, BARE in output) == ((1, True) if removed else (0, False)), output


def test_every_state_of_the_page_and_no_other_is_tried() -> None:
    assert {section.title for section in SECTIONS} == set(STATES)


def test_every_command_of_the_page_stands_in_a_section_that_is_tried() -> None:
    tried = {step for section in SECTIONS for step in (*section.steps, section.sign[0])}
    blocks = [
        line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL) for line in block.splitlines()
    ]
    inline = re.findall(r"`((?:armtempo|mpremote) [^`]*PORT[^`]*)`", PAGE)
    assert set(blocks + inline) <= tried
    assert all(section.steps for section in SECTIONS)


def test_links_lead_to_sections() -> None:
    titles = re.findall(r"^## (.+)$", PAGE, re.MULTILINE)
    anchors = {re.sub(r"[^a-z0-9 -]", "", title.lower()).replace(" ", "-") for title in titles}
    assert set(re.findall(r"\(#([^)]+)\)", PAGE)) <= anchors


def test_what_the_page_quotes_of_messages_is_said() -> None:
    """Except if the words are another program's, or MicroPython's."""
    sources = "".join(
        path.read_text(encoding="utf-8") for path in (interpreters.ROOT / "host" / "armtempo").rglob("*.py")
    )
    for words in (
        "there is no port",
        "is in use",
        "no permission to open",
        "set up for a different arm",
        "connect an STM32F405",
    ):
        assert words in PAGE
        assert words in re.sub(r'"\s+f?"', "", sources), words
