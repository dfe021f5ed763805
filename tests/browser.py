"""A real browser, headless: what a page looks like and what it asks for."""

from __future__ import annotations

import html
import json
import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
_QUIET = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--no-first-run",
    "--hide-scrollbars",
    "--host-resolver-rules=MAP * ~NOTFOUND",
]
_PROBE = """<script>addEventListener('load', () => {
  const style = getComputedStyle(document.body);
  const figures = [...document.querySelectorAll('figure svg:not(.sheet)')];
  parent.postMessage(JSON.stringify({
    fetched: performance.getEntriesByType('resource').map(entry => entry.name),
    overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    width: document.documentElement.clientWidth,
    figures: figures.map(svg => svg.getBoundingClientRect().height),
    scales: figures.map(svg => svg.getBoundingClientRect().width / svg.viewBox.baseVal.width),
    cut: [...document.querySelectorAll('body *')].filter(one => !one.closest('svg') && (
      one.scrollWidth > one.clientWidth + 1 && getComputedStyle(one).overflowX != 'visible'
      || one.getBoundingClientRect().right > document.documentElement.clientWidth + 1)).map(one => one.outerHTML),
    tables: document.querySelectorAll('table').length,
    text: document.body.innerText,
    colour: style.color, background: style.backgroundColor,
  }), '*');
});</script>"""
_FRAMES = """<!DOCTYPE html><meta charset="utf-8"><meta name="color-scheme" content="light dark">
<body><script>addEventListener('message', got => document.body.append(
  Object.assign(document.createElement('pre'), {className: 'probe', textContent: got.data})));</script>"""
_FRAME = '<iframe src="{page}" style="width: {width}px; height: 900px; border: 0"></iframe>'
"""The page as wide as a phone: a window of its own cannot be narrower than 500 pixels."""


def needed() -> None:
    """Skip the test if there is no Chromium; but in CI, where ``.ci/run`` installs it, fail."""
    if BROWSER is None and os.environ.get("CI"):
        pytest.fail("CI needs Chromium: .ci/run installs it if it is run by root")
    if BROWSER is None:
        pytest.skip("left out: no Chromium on this machine (CI has one)")


def _run(page: Path, profile: Path, *options: str) -> str:
    assert BROWSER
    command = [BROWSER, *_QUIET, f"--user-data-dir={profile}", *options, page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return done.stdout


def probe(page: Path, folder: Path, widths: Sequence[int], dark: bool = False) -> list[dict[str, Any]]:
    """What the browser finds in the page at each of these widths: see ``_PROBE``."""
    copy = folder / "probe.html"
    copy.write_text(page.read_text(encoding="utf-8").replace("</body>", _PROBE + "</body>"), encoding="utf-8")
    scheme = f"--blink-settings=preferredColorScheme={0 if dark else 1}"
    frames = folder / "frames.html"
    shown = "".join(_FRAME.format(page=copy.name, width=width) for width in widths)
    frames.write_text(_FRAMES + shown, encoding="utf-8")
    # A virtual clock: the page has its time however busy the machine is.
    dom = _run(frames, folder / "profile", "--virtual-time-budget=10000", scheme, "--dump-dom")
    found = [
        json.loads(html.unescape(text))
        for text in re.findall('<pre class="probe">(.*?)</pre>', dom, re.DOTALL)
    ]
    assert len(found) == len(widths), dom[-2000:]
    return sorted(found, key=lambda one: widths.index(one["width"]))
