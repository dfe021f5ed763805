"""Run ``make demo`` and ``make quick`` with the other Pythons of this machine, and with the oldest releases.

The environment that runs this is the one of ``make test``: it has the newest releases for its Python already. One of
each other release of Python from 3.11 on that is on PATH or that pyenv has gets the newest, and the oldest Python gets
the oldest that pyproject.toml promises. One more is tested at a time than there are cores, as installing waits for the
network; each in one process, as several would collect the same tests. Prints a line for each, the whole output for
those that fail; code 1 if one does.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PLACE = ROOT / ".cache" / "ci"
OLDEST = (3, 11)
WHAT = ["-e", ".[plot,cluster,mpy,urdf,ros,panel,docs]", "-r", "tests/requirements.txt"]
RELEASE = "import sys, venv; sys.version_info.releaselevel == 'final' and print(*sys.version_info[:2])"
QUICK = ("WORKERS=0", "PYTEST_ARGS=--brief --assert=plain")
"""Another Python shows in any variant of a test. Asserts that say no values are read in half of the time."""
DESCRIBE = """
from importlib.metadata import version
import platform
names = ("numpy", "scipy", "click", "matplotlib", "nicegui")
print("Python", platform.python_version(), "with", ", ".join(f"{name} {version(name)}" for name in names))
"""


@dataclass(frozen=True)
class Environment:
    """A Python with releases of the packages."""

    python: Path
    name: str
    options: tuple[str, ...] = ()
    """Of uv's ``pip install``."""

    @property
    def folder(self) -> Path:
        """Where it is made."""
        return PLACE / self.name


def pythons() -> dict[tuple[int, int], Path]:
    """One interpreter of each release from 3.11 on, oldest first; this environment's own for its release."""
    places = [Path(sys.executable)]
    places += [Path(found) for minor in range(11, 40) if (found := shutil.which(f"python3.{minor}"))]
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    places += sorted(pyenv.glob("versions/*/bin/python"), reverse=True)
    found: dict[tuple[int, int], Path] = {}
    for place in places:
        done = subprocess.run([place, "-c", RELEASE], capture_output=True, text=True)
        if done.returncode == 0 and done.stdout:  # one of pyenv's starters may have nothing to start
            major, minor = map(int, done.stdout.split())
            found.setdefault((major, minor), place)
    return {release: found[release] for release in sorted(found) if release >= OLDEST}


def environments(found: dict[tuple[int, int], Path]) -> list[Environment]:
    """What is to be tested."""
    newest = [
        Environment(python, f"newest-{major}.{minor}")
        for (major, minor), python in found.items()
        if (major, minor) != sys.version_info[:2]
    ]
    oldest = next(iter(found.values()))
    return [*newest, Environment(oldest, "oldest", ("--resolution", "lowest-direct"))]


def run(*command: str | Path) -> str:
    """What a command prints. Raises CalledProcessError with it."""
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    done = subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL, text=True, **both)
    if done.returncode:
        raise subprocess.CalledProcessError(done.returncode, command, done.stdout)
    return done.stdout


def make(environment: Environment, target: str, *variables: str) -> str:
    """What ``make`` prints for a target in an environment."""
    return run("make", f"VENV={environment.folder.relative_to(ROOT)}", *variables, target)


def prepare(environment: Environment) -> None:
    """Make it."""
    uv = Path(sys.executable).with_name("uv")
    run(uv, "venv", "--quiet", "--clear", "--python", environment.python, environment.folder)
    python = environment.folder / "bin" / "python"
    run(uv, "pip", "install", "--quiet", *environment.options, "--python", python, *WHAT)
    for done in ("demo", "test"):  # as the Makefile notes it
        (environment.folder / done).touch()


def test(environment: Environment) -> tuple[bool, str]:
    """Whether all passes in it, and what is to be said."""
    try:
        prepare(environment)
        make(environment, "demo")
        passed = make(environment, "quick", *QUICK).strip().splitlines()[-1]
    except subprocess.CalledProcessError as error:
        return False, f"{error.output}\nfailed: {' '.join(map(str, error.cmd))}"
    described = run(environment.folder / "bin" / "python", "-c", DESCRIBE).strip()
    return True, f"make demo, make quick, {described}: {passed}"


def main() -> int:
    """Test all; 1 if one fails."""
    PLACE.mkdir(parents=True, exist_ok=True)
    found = pythons()
    failed = False
    with ThreadPoolExecutor((os.cpu_count() or 1) + 1) as pool:
        for passed, said in pool.map(test, environments(found)):
            failed |= not passed
            print(said, flush=True)
    if len(found) == 1:
        print(f"only one Python from {'.'.join(map(str, OLDEST))} on is on this machine; no other was tested")
    return failed


if __name__ == "__main__":
    sys.exit(main())
