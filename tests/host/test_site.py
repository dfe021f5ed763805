"""The documentation site builds without a warning and has a place for every command, code and page."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import click
import pytest
from armtempo.cli import main
from armtempo_shared import meanings

from tests import interpreters, sources
from tests.interpreters import ROOT

CATALOGUE = sources.script(ROOT / "host" / "docs" / "site" / "catalogue.py")
SITE_PAGES = sorted(page.relative_to(ROOT) for page in ROOT.glob("*/docs/*.md"))


def of_the_site(test: Callable[..., None]) -> Callable[..., None]:
    """Marks of a test that looks at the built site, which is made once and takes long."""
    marked: Callable[..., None] = pytest.mark.slow(pytest.mark.long(pytest.mark.xdist_group("site")(test)))
    return marked


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the built site."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(out / "doctrees")]
    command += ["-c", "host/docs/site", ".", str(out / "html")]
    # what the pages do wrong, -W says
    environment = interpreters.environment_of_others()
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return out / "html"


@of_the_site
def test_every_page_is_built_and_reached_from_the_first(site: Path) -> None:
    first = (site / "host" / "docs" / "index.html").read_text(encoding="utf-8")
    links = set(re.findall(r'class="reference internal" href="([^"#]+)"', first))
    reached = {(site / "host" / "docs" / link).resolve() for link in links}
    for page in SITE_PAGES:
        built = (site / page).with_suffix(".html")
        assert built.exists(), page
        assert page.name == "index.md" or built.resolve() in reached, page


@of_the_site
def test_the_first_page_has_a_picture_and_two_buttons_and_no_list_of_pages(site: Path) -> None:
    text = (site / "host" / "docs" / "index.html").read_text(encoding="utf-8")
    article = text[text.index("<article") : text.index("</article>")]
    assert article.count('class="button') == 2
    assert "toctree-wrapper" not in re.sub(r'<div class="toctree-wrapper compound">\s*</div>', "", article)
    assert "arm.gif" in article
    assert "the armtempo authors" in text[text.index("<footer") :]


@of_the_site
def test_types_are_written_as_a_person_writes_them(site: Path) -> None:
    text = (site / "host" / "docs" / "api.html").read_text(encoding="utf-8")
    plain = re.sub(r"<[^>]+>", "", text)
    for name in ("minimise", "launch", "deploy", "Joint", "Wait"):
        assert f"{name}(" in plain, name
    assert not re.findall(r"armtempo\.(?:model|basics|robot|splines|records)\.[a-z_.]+\.[A-Z]\w+", plain)


@of_the_site
def test_the_papers_page_is_one_of_the_site(site: Path) -> None:
    text = (site / "host" / "docs" / "paper-repeated.html").read_text(encoding="utf-8")
    assert "sidebar" in text
    assert 'class="good">same' in text
    assert 'class="good">differs' not in text


def test_every_argument_is_described() -> None:
    context = click.Context(main)
    for name in main.list_commands(context):
        command = main.get_command(context, name)
        assert command is not None
        for argument in CATALOGUE.names_of_arguments(command):
            assert CATALOGUE.described(command, argument) or "{" in argument, f"{name} {argument}"


@of_the_site
def test_ranges_are_numbers(site: Path) -> None:
    page = re.sub(r"<[^>]+>", "", (site / "host" / "docs" / "commands.html").read_text(encoding="utf-8"))
    assert "RANGE" not in page
    assert "1 to 99" in page


def test_links_say_where_they_lead() -> None:
    for page in SITE_PAGES:
        found = re.findall(r"\[`?([\w./-]+\.md)`?\]\(", (ROOT / page).read_text(encoding="utf-8"))
        assert not found, page


@of_the_site
def test_every_command_has_its_section(site: Path) -> None:
    page = (site / "host" / "docs" / "commands.html").read_text(encoding="utf-8")
    for name in main.list_commands(click.Context(main)):
        assert f'<section id="{name}">' in page, name
    assert "<td><p></p></td>" not in page


@of_the_site
def test_every_code_of_the_board_is_listed(site: Path) -> None:
    page = (site / "host" / "docs" / "errors.html").read_text(encoding="utf-8")
    for code, (name, _, _) in meanings.ERRORS.items():
        assert f">{code}<" in re.sub(r"</?(span|code|p)[^>]*>", "", page)
        assert name in page


@of_the_site
def test_the_top_leads_to_the_first_page(site: Path) -> None:
    assert "host/docs/index.html" in (site / "index.html").read_text(encoding="utf-8")
