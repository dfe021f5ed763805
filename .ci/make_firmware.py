"""Make the firmware of one board for a release: ``python .ci/make_firmware.py BOARD CHECKOUT``.

CHECKOUT: a checkout of MicroPython; if there is none, the release that armtempo is built with is fetched, with the
submodules of the board. The firmware goes to ``armtempo-firmware-BOARD.zip`` here, its sha256 next to it.
"""

import hashlib
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from armtempo.deploy.firmware import checkout

DATE = (2020, 1, 1, 0, 0, 0)


def main(board: str, micropython: Path) -> None:
    """Fetch, build, pack."""
    if not micropython.exists():
        subprocess.run(checkout.how_to_get(micropython).split(), check=True)
        port = micropython / "ports" / "stm32"
        subprocess.run(["make", "-C", str(port), f"BOARD={board}", "submodules"], check=True)
    with TemporaryDirectory() as name:
        out = Path(name) / f"armtempo-firmware-{board}"
        options = ["--board", board, "--micropython", str(micropython), "--out", str(out)]
        subprocess.run([sys.executable, "-m", "armtempo", "firmware", *options], check=True)
        archive = Path(f"{out.name}.zip")
        pack(out, archive)
        digest = hashlib.sha256(archive.read_bytes()).hexdigest()
        Path(f"{archive}.sha256").write_text(f"{digest}  {archive}\n")


def pack(folder: Path, archive: Path) -> None:
    """The files of a folder with one date, so that the same sources make the same archive; an ELF file holds paths."""
    with ZipFile(archive, "w", ZIP_DEFLATED) as made:
        for path in sorted(each for each in folder.iterdir() if each.suffix != ".elf"):
            made.writestr(ZipInfo(f"{folder.name}/{path.name}", DATE), path.read_bytes())


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
