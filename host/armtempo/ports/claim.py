"""Who has a port: one file for each port, in a folder that only this user can read.

The folder is ``armtempo`` below ``$XDG_RUNTIME_DIR``, else a private one for temporary files (``claim_file``). A
program that was killed leaves its file; nobody answers at its address then.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from armtempo.ports import claim_file
from armtempo.ports.claim_file import VERSION as VERSION

PATIENCE_S = 3.0
"""How long to wait for a port in use: what only asks, as ``status`` does, or was told to end, has it for less."""

LOCAL_SOCKETS = os.name == "posix"
"""Whether sockets are files of the file system; else they are ports of localhost, and a token is asked for."""


class PortClaim(NamedTuple):
    """One program's claim to one port. (A data class would take 10 ms to import, too long for a stop.)"""

    name: str
    """The port, by a name that is the same for every program (``ports.names.same_for_all``)."""
    port: str
    """The same as its user called it."""
    device: str
    """What can be opened: for a virtual board the device that it was given."""
    program: str
    """What the program was called with, in short."""
    pid: int
    number: str
    """Tells one claim from another."""
    address: str
    """Path of a socket, or a port of localhost."""
    token: str
    """What a caller must know; "" if the socket's permissions are enough."""
    version: int = VERSION

    @property
    def who(self) -> str:
        """The program as messages name it."""
        return f"'{self.program}' (process {self.pid})"

    def write(self) -> None:
        """Put the claim in place of an earlier one. OSError if that fails."""
        folder()
        for path in self._files():
            before = _read(path)
            if before is not None and before.number != self.number:
                self._write(before._marker(path))  # it may wake up after this program has ended
            self._write(path)

    def _write(self, path: Path) -> None:
        aside = path.with_suffix(f".{self.number}")
        with os.fdopen(os.open(aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(claim_file.text(map(str, self)))
        os.replace(aside, path)

    def _marker(self, path: Path) -> Path:
        """Who has taken the port over from this program, also when that has given it up again."""
        return path.with_name(f"{self.number}.taken")

    def taken_by(self) -> PortClaim | None:
        """The claim of another program that is, or was, in the place of this one."""
        files = self._files()
        found = [_read(path) for path in (*files, *(self._marker(file) for file in files))]
        return next((claim for claim in found if claim is not None and claim.number != self.number), None)

    def remove(self) -> None:
        """Give the port up, unless another program has claimed it since."""
        with suppress(OSError):
            for path in self._files():
                self._marker(path).unlink(missing_ok=True)
                found = _read(path)
                if found is not None and found.number == self.number:
                    path.unlink()
        with suppress(OSError):
            if LOCAL_SOCKETS:
                Path(self.address).unlink()

    def _files(self) -> list[Path]:
        """Where the claim to this port is: in the folder for new ones, and wherever an earlier one does."""
        import hashlib

        name = hashlib.sha256(self.name.encode()).hexdigest()[:16] + claim_file.SUFFIX
        first, *others = [Path(place, name) for place in claim_file.folders()]
        return [first, *(path for path in others if path.exists())]


def new(name: str, port: str, device: str) -> PortClaim:
    """This program's claim, not yet written. OSError if there is no private folder for it."""
    import secrets

    number = secrets.token_hex(8)
    address = str(folder() / f"{number}.socket") if LOCAL_SOCKETS else ""
    token = "" if LOCAL_SOCKETS else secrets.token_hex(16)
    return PortClaim(name, port, device, program(), os.getpid(), number, address, token)


def find(name: str, port: str) -> PortClaim | None:
    """Who has claimed the port, dead or alive; ``port`` as the user calls it, for a link whose device is gone."""
    for claim in claims():
        if claim.name == name or claim.port == port:
            return claim
    return None


def claims() -> Iterator[PortClaim]:
    """All claims of this user's programs."""
    for path in claim_file.paths():
        found = _read(Path(path))
        if found is not None:
            yield found


def folder() -> Path:
    """Where claims and sockets are, made where it is missing. OSError if it is not this user's alone."""
    place = Path(next(claim_file.folders()))
    place.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not claim_file.is_private(str(place)):
        raise OSError(None, "is not this user's alone", str(place))
    return place


def program() -> str:
    """This program's command line, in short."""
    words = sys.argv[:1] and [Path(sys.argv[0]).name, *sys.argv[1:]]
    if words and words[0] in ("__main__.py", "-c"):
        words[0] = "armtempo" if words[0] == "__main__.py" else "python"
    text = " ".join(words) or "python"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _read(path: Path) -> PortClaim | None:
    """The claim in a file; None if it is gone, damaged or of another version."""
    try:
        name, port, device, program, pid, number, address, token, version = claim_file.read(str(path))
        return PortClaim(name, port, device, program, int(pid), number, address, token, int(version))
    except ValueError:
        return None
