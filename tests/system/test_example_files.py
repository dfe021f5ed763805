"""Every file of host/examples runs, and leaves what it says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests import forked
from tests.interpreters import ROOT
from tests.system import commandline

EXAMPLES = ROOT / "host" / "examples"
LEAVES = {
    "feeding.py": "runs/feed-001/report.html",
    "turntable.py": "runs/half-turn-001/samples-02.csv",
    "pen.py": "pen.png",
    "ros_trajectory.py": "feed.yaml",
    "sweep.py": "sweep.csv",
    "animate.py": "arm.gif",
    "plan_and_plot.ipynb": "reach.png",
    "pick_and_place.py": "two-parts.toml",
}
ARGUMENTS = {"sweep.py": ["--jobs", "6"]}


@pytest.mark.parametrize("name", LEAVES)
def test_example(name: str, tmp_path: Path) -> None:
    script = EXAMPLES / name
    if script.suffix == ".ipynb":
        cells = json.loads(script.read_text(encoding="utf-8"))["cells"]
        code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        script = tmp_path / "notebook.py"
        script.write_text(f"import matplotlib\nmatplotlib.use('Agg')\n{code}", encoding="utf-8")
    elif "repeat=3" in (text := script.read_text(encoding="utf-8")):  # takes time and shows nothing new here
        script = tmp_path / name
        script.write_text(text.replace("repeat=3", "repeat=1"), encoding="utf-8")
    done = forked.run(script, *ARGUMENTS.get(name, []), cwd=tmp_path, timeout=commandline.SLOW_S)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / LEAVES[name]).stat().st_size > 0


def test_none_is_left_out() -> None:
    files = {path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".ipynb")}
    page = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    assert files == set(LEAVES)
    assert all(f"({name})" in page for name in files)
