"""Make the firmware of one board for a release: ``python .ci/make_firmware.py BOARD CHECKOUT``.

CHECKOUT: a checkout of MicroPython; where there is none, the release that armtempo is built with is fetched, with the
submodules of the board. The firmware goes to ``armtempo-firmware-BOARD.zip`` here.
"""

import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from armtempo.deploy.firmware import checkout


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
        shutil.make_archive(out.name, "zip", out.parent, out.name)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
