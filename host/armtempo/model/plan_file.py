"""The JSON files of plans, with a checksum of their content, independent of white space."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from armtempo.basics import json_codec, json_text
from armtempo.basics.atomic_file import check_replaceable, os_reason, replace_text
from armtempo.basics.errors import InputError

AGAIN = "plan it again"
RUN = "run.json"
"""File next to that of the plan in a run folder."""
LOG = logging.getLogger("armtempo")


@dataclass(frozen=True)
class PlanFile:
    """A kind of file."""

    format: str
    key: str
    """Of the plan."""
    what: str
    made_by: str
    """Command that makes one."""
    rule: str
    """Which file is replaced without being asked for."""
    versions: tuple[int, ...]
    """Those that are read, the last is written; version 1 has no checksum."""

    def save(self, path: Path | str, plan: Any, force: bool, same: Callable[[Any], bool]) -> None:
        """Write a plan, atomically. Raises as ``check_replaceable``, and InputError if it cannot be written."""
        self.check_replaceable(path, plan, force, same)
        replace_text(Path(path), self._text(plan))

    def check_replaceable(
        self, path: Path | str, plan: Any, force: bool, same: Callable[[Any], bool]
    ) -> None:
        """Raise InputError if a file must not be replaced by that of a plan.

        It may be with ``force``, or if it is unaltered and its content is of the ``same`` job or sequence as ours.
        """
        allowed = force or self._is_earlier(Path(path), same)
        check_replaceable(Path(path), self._text(plan), allowed, self.rule)

    def read(self, path: Path | str, altered: bool = False) -> Any:
        """The content of a file, still to be decoded.

        ``altered``: accept a file that was altered after it had been written. Raises InputError for a file that is
        missing, damaged, altered, or of another format or version.
        """
        content = self._json(path)
        if not self._fits(content):
            raise InputError(f"{path}: is not {self.what}", f"make one with: {self.made_by}")
        version = content.get("version")
        if version not in self.versions:
            read = " and ".join(map(str, self.versions))
            raise InputError(f"{path}: has version {version!r}, this program reads {read}", AGAIN)
        expected = {"format", "version", self.key} | ({"sha256"} if version > 1 else set())
        if content.keys() != expected:
            raise InputError(f"{path}: unknown or missing key besides {', '.join(sorted(expected))}", AGAIN)
        if version == 1:
            LOG.warning(
                f"{path} was written before trajectory files had a checksum: whether it was altered is not known"
            )
        elif content["sha256"] != checksum(content[self.key]):
            if not altered:
                raise InputError(
                    f"{path} was altered after it had been written: its checksum does not fit", _cure(path)
                )
            LOG.warning(f"{path} was altered after it had been written; accepted with --altered")
        return content[self.key]

    def is_at(self, path: Path) -> bool:
        """Whether a file is of this kind; False if it cannot be read."""
        try:
            return self._fits(self._json(path))
        except InputError:
            return False

    def _is_earlier(self, path: Path, same: Callable[[Any], bool]) -> bool:
        try:
            content = self._json(path)
            before = content[self.key]
            unaltered = content["version"] == 1 or content["sha256"] == checksum(before)
            return bool(self._fits(content) and unaltered and same(before))
        except (InputError, LookupError, TypeError):
            return False

    def _fits(self, content: Any) -> bool:
        return isinstance(content, dict) and content.get("format") == self.format

    def _text(self, plan: Any) -> str:
        content = json_codec.encode(plan)
        head = {"format": self.format, "version": self.versions[-1], "sha256": checksum(content)}
        return json.dumps({**head, self.key: content}, indent=1, allow_nan=False) + "\n"

    def _json(self, path: Path | str) -> Any:
        try:
            text = Path(path).read_text(encoding="utf-8")
        except FileNotFoundError:
            raise InputError(
                f"{path}: no such file", f"check the path, or make it with: {self.made_by} -o {path}"
            ) from None
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: cannot be read: {os_reason(error)}", "check its permissions") from None
        try:
            return json_text.loads(text)
        except ValueError as error:
            raise InputError(f"{path}: damaged or cut: {error}", "plan it again or copy it again") from None


def checksum(content: Any) -> str:
    """The sha256 of a plan's content, in hex."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _cure(path: Path | str) -> str:
    if (Path(path).parent / RUN).exists():
        return "it no longer says what was run: bring the original back, or move it out of the run folder"
    return "plan it again; or, if you know what was altered, take it with --altered"
