"""Claims: one file for each port that a program has open, in a folder that only this user can read.

The folder is ``armtempo`` in ``$XDG_RUNTIME_DIR``, else one for temporary files, else one in the home folder
(``claim_file``). A killed program leaves its file, but does not answer at its address.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from armtempo.ports import claim_file
from armtempo.ports.claim_file import VERSION as VERSION

PATIENCE_S = 3.0
"""Time to wait for a port in use; ``status`` and programs that were told to end close it sooner."""

LOCAL_SOCKETS = os.name == "posix"
"""Whether sockets are files; otherwise they are TCP ports of localhost, with a token."""


class PortClaim(NamedTuple):
    """One program's claim to one port. (A data class would take 10 ms to import, too long for a stop.)"""

    name: str
    """Canonical name of the port (``ports.names.same_for_all``)."""
    port: str
    """The port as its user wrote it."""
    device: str
    """The device that can be opened; for a virtual board, its pseudo terminal."""
    program: str
    """The program's command line, shortened."""
    pid: int
    number: str
    """Identifies the claim."""
    address: str
    """Path of a socket, or a TCP port of localhost."""
    token: str
    """Secret that a caller must send; "" if the socket's permissions suffice."""
    version: int = VERSION

    @property
    def who(self) -> str:
        """The program's description for messages."""
        return f"'{self.program}' (process {self.pid})"

    def write(self) -> None:
        """Write the claim, replacing an earlier one; raises OSError if that fails."""
        for path in self._files():
            before = _read(path)
            if before is not None and before.number != self.number:
                self._write(before._marker(path))  # the other program may wake up after this one has ended
            self._write(path)

    def _write(self, path: Path) -> None:
        aside = path.with_suffix(f".{self.number}")
        with os.fdopen(os.open(aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
            file.write(claim_file.text(map(str, self)))
        os.replace(aside, path)

    def _marker(self, path: Path) -> Path:
        """The file that records who took the port over from this program, kept after that program closes it."""
        return path.with_name(f"{self.number}.taken")

    def beat(self) -> None:
        """Give a sign of life: the time of the claim's file."""
        for path in self._files():
            found = _read(path)
            if found is not None and found.number == self.number:
                with suppress(OSError):
                    os.utime(path)

    def silent_s(self) -> float:
        """Time since the last ``beat``, or since the claim was written; infinite without a file."""
        beaten_s = -math.inf
        for path in self._files():
            with suppress(OSError):
                beaten_s = max(beaten_s, path.stat().st_mtime)
        return max(0.0, time.time() - beaten_s)

    def taken_by(self) -> PortClaim | None:
        """The claim of the program that has taken the port over, if any."""
        files = self._files()
        found = [_read(path) for path in (*files, *(self._marker(file) for file in files))]
        return next((claim for claim in found if claim is not None and claim.number != self.number), None)

    def remove(self) -> None:
        """Remove the claim, unless another program has claimed the port since."""
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
        """The files of claims to this port: where this claim is to be, and where an earlier claim is."""
        import hashlib

        name = hashlib.sha256(self.name.encode()).hexdigest()[:16] + claim_file.SUFFIX
        own = folder() / name
        others = [Path(place, name) for place in claim_file.folders() if claim_file.is_private(place)]
        return [own, *(path for path in others if path != own and path.exists())]


def new(name: str, port: str, device: str) -> PortClaim:
    """This program's claim, not yet written; raises OSError if there is no private folder for it."""
    import secrets

    number = secrets.token_hex(8)
    address = str(folder() / f"{number}.socket") if LOCAL_SOCKETS else ""
    token = "" if LOCAL_SOCKETS else secrets.token_hex(16)
    return PortClaim(name, port, device, program(), os.getpid(), number, address, token)


def find(name: str, port: str) -> PortClaim | None:
    """The claim to the port, even of an ended program; ``port``: as the user wrote it, in case its device has
    disappeared."""
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
    """The folder for new claims and sockets, created if missing; raises OSError if others can access all of them."""
    problem = ""
    for place in map(Path, claim_file.folders()):
        try:
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            problem = f"{place}: {error.strerror}"
            continue
        if claim_file.is_private(str(place)):
            return place
        problem = f"{place}: others can access it"
    raise OSError(None, problem)


def program() -> str:
    """This program's command line, shortened."""
    words = sys.argv[:1] and [Path(sys.argv[0]).name, *sys.argv[1:]]
    if words and words[0] in ("__main__.py", "-c"):
        words[0] = "armtempo" if words[0] == "__main__.py" else "python"
    text = " ".join(words) or "python"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _read(path: Path) -> PortClaim | None:
    """The claim in a file; None if it is missing, damaged or of another version."""
    try:
        name, port, device, program, pid, number, address, token, version = claim_file.read(str(path))
        return PortClaim(name, port, device, program, int(pid), number, address, token, int(version))
    except ValueError:
        return None
