"""Settings of the commands, and the source of each: an option, a variable, the project folder, a default."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from armtempo.basics.errors import InputError

FILE = "armtempo.toml"
PORT, ARM, JOB, RUNS = NAMES = ("port", "arm", "job", "runs")
OPTIONS = {PORT: "--port", ARM: "--arm", JOB: "--job", RUNS: "--out"}
_DEFAULT_RUNS = "runs"


@dataclass(frozen=True)
class Setting:
    """One setting."""

    name: str
    value: str
    """"" if nothing is set."""
    source: str
    """Description of its source; "" if nothing is set."""

    @property
    def path(self) -> Path:
        """The value as a path; relative ones are relative to the current folder."""
        return Path(self.value)

    def __bool__(self) -> bool:
        return bool(self.value)


class ProjectSettings:
    """The settings in ``folder`` (default: the current folder): an option overrides a variable, that the
    project folder.

    Raises InputError if ``armtempo.toml`` is invalid.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder or Path()

    @cached_property
    def file(self) -> Path | None:
        """The nearest ``armtempo.toml``, in the folder or above it; None if there is none."""
        here = self._folder.absolute()
        for place in (here, *here.parents):
            if (place / FILE).is_file():
                return place / FILE
        return None

    def get(self, name: str, given: str | Path | None = None) -> Setting:
        """The setting ``name``; ``given``: the option's value, if given."""
        if given is not None and str(given):
            return Setting(name, str(given), OPTIONS[name])
        variable = variable_of(name)
        if os.environ.get(variable):
            return Setting(name, os.environ[variable], f"variable {variable}")
        if name in self._in_file:
            return Setting(name, self._in_file[name], str(_near(self.file)))
        if name == RUNS:
            return self._default_runs()
        return Setting(name, "", "")

    def _default_runs(self) -> Setting:
        if self.file is None:
            return Setting(RUNS, _DEFAULT_RUNS, "default")
        return Setting(RUNS, _relative_to(self.file, _DEFAULT_RUNS), f"default next to {_near(self.file)}")

    @cached_property
    def _in_file(self) -> dict[str, str]:
        """The settings in ``armtempo.toml``; its paths are relative to it."""
        if self.file is None:
            return {}
        from armtempo.basics import toml_table  # slow to import, and most commands have no project folder

        table = toml_table.read(_near(self.file))
        found = {name: table.text(name) for name in NAMES if table.has(name)}
        table.known(*NAMES)
        table.done()
        return {name: _from_file(self.file, name, value) for name, value in found.items()}


def variable_of(name: str) -> str:
    """The environment variable that sets a setting."""
    return f"ARMTEMPO_{name.upper()}"


def missing_setting(name: str, what: str) -> InputError:
    """The error if a needed setting is missing; ``what``: the error's text."""
    return InputError(
        what,
        f'give {OPTIONS[name]}, or set {variable_of(name)}, or write {name} = "…" into an {FILE} '
        "in this folder or above it ('armtempo config' shows what is set)",
    )


def _from_file(file: Path, name: str, value: str) -> str:
    if (
        name == ARM
        and Path(value).name == value
        and not Path(value).suffix
        and not (file.parent / value).exists()
    ):
        return value  # the name of a shipped arm
    if name != PORT:
        return _relative_to(file, value)
    kind, colon, folder = value.partition(":")
    return f"{kind}:{_relative_to(file, folder)}" if (kind, colon) == ("sim", ":") and folder else value


def _relative_to(file: Path, value: str) -> str:
    """A path relative to the file, made relative to the current folder."""
    return str(_near(file.parent) / Path(value).expanduser())


def _near(path: Path | None) -> Path:
    """The shortest path from the current folder."""
    assert path is not None
    try:
        short = os.path.relpath(path)
    except ValueError:  # on another drive
        return path
    return Path(short) if len(short) < len(str(path)) else path
