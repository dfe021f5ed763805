"""Every file of host/examples runs, and leaves what it says."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.interpreters import ROOT
from tests.system import commandline

EXAMPLES = ROOT / "host" / "examples"
LEAVES = {
    "feeding.py": "runs/feed-001/report.html",
    "turntable.py": "runs/half-turn-001/samples-02.csv",
    "pen.py": "pen.png",
    "ros_trajectory.py": "feed.yaml",
    "sweep.py": "sweep.csv",
    "compare_searches.py": "searches.csv",
    "animate.py": "arm.gif",
    "plan_and_plot.ipynb": "reach.png",
    "pick_and_place.py": "two-parts.toml",
}
FEW = ["--populations", "4", "--seeds", "2", "--iterations", "3"]
ARGUMENTS = {"sweep.py": ["--jobs", "6"], "compare_searches.py": FEW}


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
    done = commandline.python(script, *ARGUMENTS.get(name, []), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / LEAVES[name]).stat().st_size > 0


def test_searches_on_a_cluster_give_the_same(tmp_path: Path) -> None:
    import distributed  # takes long, and every process that collects the tests would do it

    script = EXAMPLES / "compare_searches.py"
    found = []
    with distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster:
        for where in ([], ["--scheduler", cluster.scheduler_address]):
            command = [sys.executable, str(script), *FEW, *where]
            subprocess.run(command, cwd=tmp_path, check=True)
            found.append((tmp_path / "searches.csv").read_text())
    assert found[0] == found[1]
    assert found[0].count("\n") == 13


def test_none_is_left_out() -> None:
    files = {path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".ipynb")}
    page = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    assert files == set(LEAVES)
    assert all(f"({name})" in page for name in files)
