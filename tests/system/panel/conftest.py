"""One board, one panel and one browser for all tests of the panel: each start takes seconds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests import browser
from tests.system import panels
from tests.system.panel.files import DAY, MARKUP, SEQUENCE
from tests.system.panels import Panel, Panels


@pytest.fixture(scope="package")
def play() -> Iterator[Any]:
    """Playwright."""
    browser.needed()
    with panels.playwright() as made:
        yield made


@pytest.fixture(scope="package")
def chromium(play: Any) -> Iterator[Any]:
    """A browser."""
    made = panels.chromium(play)
    yield made
    made.close()


@pytest.fixture(scope="package")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Panels]:
    """One board, and one panel as long as it lives: each start takes seconds."""
    folder = tmp_path_factory.mktemp("panel")
    for name, text in {
        "all": SEQUENCE,
        "day": DAY,
        "other": 'name = "other"\n[[step]]\nwait_s = 1\n',
    }.items():
        (folder / f"{name}.toml").write_text(text)
    (folder / "runs" / MARKUP).mkdir(parents=True)
    for name in ("run.json", "report.html"):
        (folder / "runs" / MARKUP / name).write_text(
            "<script>document.title = 'hurt'</script><p>of another arm"
        )
    with panels.panels(folder) as made:
        yield made


@pytest.fixture(scope="package")
def failed_before(request: pytest.FixtureRequest) -> int:
    """How many tests have failed before these."""
    return request.session.testsfailed


@pytest.fixture(autouse=True)
def not_in_vain(request: pytest.FixtureRequest, failed_before: int) -> None:
    """A panel that is dead is waited for twice, not in every test."""
    if request.session.testsfailed - failed_before > 1:
        pytest.fail("left out, as two tests before it have failed")


@pytest.fixture
def panel(running: Panels) -> Panel:
    """A panel that runs."""
    return running()


@pytest.fixture(scope="package")
def window(chromium: Any) -> Any:
    """A window of the browser."""
    return chromium.new_context(viewport=panels.SMALL)


@pytest.fixture
def page(window: Any, panel: Panel) -> Any:
    """One page as long as it and the panel live, in control: each takes seconds to open."""
    for one in window.pages:
        if one.url == panel.address:
            return panels.in_control(one)
        one.close()
    return panels.opened(window, panel.address, drawn=False)
