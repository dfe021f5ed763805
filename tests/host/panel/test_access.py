"""Who may ask the panel's server."""

from __future__ import annotations

import asyncio
import ipaddress
import re
import socket
from contextlib import ExitStack
from typing import Any
from urllib.parse import urlsplit

import pytest
from armtempo.cli.panel import _way_in
from armtempo.panel.access import COOKIE, MOST_BYTES, Access, Policy
from armtempo.panel.server import listen, reachable, served_hosts, url


async def _inner(scope: Any, receive: Any, send: Any) -> None:
    message = await receive() if scope["type"] == "http" else {"body": b""}
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": message["body"]})


def answer(
    access: Access, kind: str = "http", query: str = "", body: tuple[bytes, ...] = (b"",), **headers: str
) -> list[dict[str, Any]]:
    """What is sent for a request whose ``body`` comes in chunks."""
    sent: list[dict[str, Any]] = []
    given = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    scope = {
        "type": kind,
        "path": "/",
        "query_string": query.encode(),
        "headers": given,
        "client": ("1.2.3.4", 5),
    }
    chunks = list(body)

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": chunks.pop(0), "more_body": bool(chunks)}

    async def send(message: Any) -> None:
        sent.append(message)

    asyncio.run(access(scope, receive, send))
    return sent


def access(token: str = "secret", inner: Any = _inner) -> Access:
    """That of a panel at 127.0.0.1:8088."""
    return Access(inner, {"127.0.0.1", "arm.local"}, token, 8088)


ASKED = {"host": "127.0.0.1:8088", "cookie": f"{COOKIE.format(port=8088)}=secret"}
"""Headers of a request that is served."""


PAGE = {"origin": "http://127.0.0.1:8088"}
"""The further header of a connection."""


@pytest.mark.parametrize(
    ("headers", "allowed"),
    [
        ({}, True),
        ({"origin": "http://127.0.0.1:8088", "sec_fetch_site": "same-origin"}, True),
        ({"sec_fetch_site": "none", "sec_fetch_mode": "navigate"}, True),
        ({"origin": "http://evil.example"}, False),
        ({"origin": "null"}, False),
        ({"origin": "http://["}, False),
        ({"host": "["}, False),
        ({"host": "[::1"}, False),
        ({"host": "evil.example:8088"}, False),
        ({"host": ""}, False),
        ({"sec_fetch_site": "cross-site", "sec_fetch_mode": "no-cors"}, False),
        ({"sec_fetch_site": "cross-site", "sec_fetch_mode": "navigate"}, False),
        ({"sec_fetch_site": "same-site", "sec_fetch_mode": "navigate"}, False),
        ({"content_length": str(MOST_BYTES + 1)}, False),
        ({"content_length": "many"}, False),
        ({"content_length": "\xb2"}, False),
    ],
)
def test_who_may_ask(headers: dict[str, str], allowed: bool, caplog: pytest.LogCaptureFixture) -> None:
    asked = {**ASKED, **headers}
    assert (answer(access(), **asked)[0].get("status") == 200) == allowed
    if not allowed:
        assert "refused '/' from 1.2.3.4" in caplog.text
        refused = answer(access(), "websocket", **{**PAGE, **asked})
        assert [message["type"] for message in refused] == ["websocket.close"]


def test_a_connection_names_the_page_that_it_comes_from() -> None:
    refused = answer(access(), "websocket", **ASKED)
    assert [message["type"] for message in refused] == ["websocket.close"]
    assert answer(access(), "websocket", **ASKED, **PAGE)[0]["type"] != "websocket.close"


def test_a_body_in_chunks_is_whole_or_refused() -> None:
    assert answer(access(), body=(b"a", b"", b"b"), **ASKED)[-1]["body"] == b"ab"
    large = answer(access(), body=(b"x" * MOST_BYTES, b"x", b"not read"), **ASKED)
    assert large[0]["status"] == 413


@pytest.mark.parametrize(
    ("query", "cookie", "allowed"),
    [
        ("token=secret", "", True),
        ("", f"{COOKIE.format(port=8088)}=secret", True),
        ("", f"{COOKIE.format(port=8089)}=secret", False),  # of another panel on this machine
        ("", "", False),
        ("token=Secret", "", False),
        ("token=", f"{COOKIE.format(port=8088)}=", False),
        ("", "a=b; =; \x7f", False),
        ("token=%C3%A9", "", False),
    ],
)
@pytest.mark.parametrize("host", ["arm.local:8088", "127.0.0.1:8088"])
def test_everybody_needs_the_token(host: str, query: str, cookie: str, allowed: bool) -> None:
    sent = answer(access(), query=query, host=host, cookie=cookie)
    assert (sent[0].get("status") == 200) == allowed
    kept = any(b"HttpOnly" in value for name, value in sent[0]["headers"] if name == b"set-cookie")
    assert kept == (query == "token=secret")


def test_an_address_with_the_token_is_opened_from_anywhere_and_framed_nowhere() -> None:
    link = {"host": "127.0.0.1:8088", "sec_fetch_site": "cross-site"}
    start = answer(access(), query="token=secret", **link, sec_fetch_mode="navigate")[0]
    assert start["status"] == 200
    assert (b"x-frame-options", b"DENY") in start["headers"]
    assert answer(access(), query="token=secret", **link, sec_fetch_mode="no-cors")[0]["status"] == 403


def test_a_page_runs_its_own_scripts_only() -> None:
    async def page(scope: Any, receive: Any, send: Any) -> None:
        await send(
            {"type": "http.response.start", "status": 200, "headers": [(b"content-type", b"text/html")]}
        )
        await send({"type": "http.response.body", "body": b"<script>own()</scr", "more_body": True})
        await send({"type": "http.response.body", "body": b"ipt>&lt;script>"})

    start, body = answer(Policy(page), **ASKED)  # type: ignore[arg-type]
    headers = dict(start["headers"])
    (nonce,) = re.findall(rb'nonce="([^"]+)"', body["body"])
    policy = headers[b"content-security-policy"]
    assert int(headers[b"content-length"]) == len(body["body"])
    assert b"script-src 'self' 'nonce-" + nonce in policy
    assert b"frame-ancestors 'none'" in policy
    assert b"unsafe-inline" not in policy.partition(b"script-src")[2].partition(b";")[0]
    assert b"connect-src 'self' ws://127.0.0.1:8088" in policy


@pytest.mark.parametrize(("host", "loopback"), [("0.0.0.0", False), ("127.0.0.1", True), ("::1", True)])
def test_the_printed_addresses_work(host: str, loopback: bool) -> None:
    with listen(host, 0) as listening:
        bound, port = listening.getsockname()[:2]
        addresses = reachable(bound)
        assert addresses
        guarded = Access(_inner, served_hosts(bound), "secret", port)
        for address in addresses:
            assert not ipaddress.ip_address(address).is_unspecified
            with socket.create_connection((address, port), timeout=10):
                pass
            page = urlsplit(url(address, port, "secret"))
            assert answer(guarded, query=page.query, host=page.netloc)[0]["status"] == 200
    assert ipaddress.ip_address(addresses[-1]).is_loopback  # for this machine's browser
    assert ipaddress.ip_address(addresses[0]).is_loopback == (loopback or len(addresses) == 1)


def test_the_page_that_is_opened_brings_the_token_and_nobody_else_reads_it() -> None:
    """Arguments of a browser are read by every user of the machine: it gets the name of a file."""
    address = url("::1", 8088, "secret")
    with ExitStack() as stack:
        page = _way_in(stack, address)
        assert page.parent.stat().st_mode & 0o077 == 0
        assert f"url={address}" in page.read_text()
        assert "secret" not in str(page)
        assert address == "http://[::1]:8088/?token=secret"
    assert not page.exists()
