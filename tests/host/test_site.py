"""The documentation site builds without a warning and has a place for every command, code and page."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import click
import pytest
from armtempo.cli import main
from armtempo_shared import meanings

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("site")]  # what they share is made once

ROOT = Path(__file__).parents[2]
PAGES = sorted(page.relative_to(ROOT) for page in ROOT.glob("*/docs/*.md"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the built site."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(out / "doctrees")]
    done = subprocess.run(
        [*command, "-c", "host/docs/site", ".", str(out / "html")], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return out / "html"


def test_every_page_is_built_and_reached_from_the_first(site: Path) -> None:
    first = (site / "host" / "docs" / "index.html").read_text(encoding="utf-8")
    links = set(re.findall(r'class="reference internal" href="([^"#]+)"', first))
    reached = {(site / "host" / "docs" / link).resolve() for link in links}
    for page in PAGES:
        built = (site / page).with_suffix(".html")
        assert built.exists(), page
        assert page.name == "index.md" or built.resolve() in reached, page


def test_every_command_has_its_section(site: Path) -> None:
    page = (site / "host" / "docs" / "commands.html").read_text(encoding="utf-8")
    for name in main.list_commands(click.Context(main)):
        assert f'<section id="{name}">' in page, name


def test_every_code_of_the_board_is_listed(site: Path) -> None:
    page = (site / "host" / "docs" / "errors.html").read_text(encoding="utf-8")
    for code, (name, _, _) in meanings.ERRORS.items():
        assert f">{code}<" in re.sub(r"</?(span|code|p)[^>]*>", "", page)
        assert name in page


def test_the_top_leads_to_the_first_page(site: Path) -> None:
    assert "host/docs/index.html" in (site / "index.html").read_text(encoding="utf-8")
