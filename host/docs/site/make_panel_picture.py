"""panel.png: the panel in a browser, with the paper's job planned and played to its middle.

It needs Chromium and the Python package playwright.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from typing import Any

from armtempo.model import shipped
from playwright.sync_api import sync_playwright

PANEL = ["-c", "from armtempo.__main__ import main; main()", "panel", "--port", "sim", "--no-show"]
SIZE = {"width": 1366, "height": 768}
GRAPHICS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
WAIT_MS = 120_000


def press(page: Any, place: str) -> None:
    """Press a button until a press is in time, which a busy machine may not manage."""
    before = page.evaluate("armtempo.number")
    while page.evaluate("before => !(armtempo.answered?.[0] > before) || armtempo.answered[1]", before):
        before = page.evaluate("armtempo.number")
        page.locator(place).click()
        page.wait_for_function("before => armtempo.answered?.[0] > before", arg=before)


def picture(page: Any, address: str) -> None:
    """Home the arm, plan the job, play it to its middle, and write the picture."""
    page.set_default_timeout(WAIT_MS)
    page.goto(address)
    page.wait_for_function("window.armtempo?.offsets_ms.length && armtempo.renderer")
    page.locator(".armtempo-panels button:has-text('Home…')").click()
    press(page, "[role=dialog] button:has-text('The arm is at home')")
    page.locator("[role=tab]:has-text('Job')").click()
    press(page, "button:has-text('Plan'):not([role=tab])")
    page.wait_for_selector("text=Motion time")
    page.locator("[aria-label='Time on the model']").click()
    page.wait_for_timeout(5000)  # a slow machine draws the path later
    page.screenshot(path="panel.png")


def main() -> None:
    """Write panel.png here."""
    command = [sys.executable, *PANEL, "--web-port", "0", "--job", str(shipped.job_path())]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as panel, sync_playwright() as play:
        try:
            assert panel.stdout
            address = panel.stdout.readline().strip()
            browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=GRAPHICS)
            picture(browser.new_page(viewport=SIZE), address)
        finally:
            panel.terminate()


if __name__ == "__main__":
    main()
