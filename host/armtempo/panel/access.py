"""Access control of the server: only its own pages, in no frame, and only with the token."""

from __future__ import annotations

import hmac
import logging
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

COOKIE = "armtempo_token_{port}"
"""A browser sends a cookie to every port of a host, so that two panels need two names."""
MOST_BYTES = 1_000_000
"""Largest body of a request; a page of via points has a few thousand bytes."""
_TOO_MUCH = f"more than {MOST_BYTES} bytes"
_LOG = logging.getLogger("armtempo")
_NONCE = 16
POLICY = (
    "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; object-src 'none'; "
    "script-src 'self' 'nonce-{nonce}' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; font-src 'self' data:; "
    "img-src 'self' data: blob:; connect-src 'self' {socket}; worker-src 'self' blob:"
)
"""NiceGUI compiles templates in the browser ('unsafe-eval'); text of a file or a board in the page is no script."""
_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),  # the address has the token
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
)


class Access:
    """ASGI middleware that protects an application.

    ``hosts``: allowed host names, against DNS rebinding; ``token``: required from every client, also on this machine,
    which others may use too: first in the address and then in a cookie of this ``port``.
    """

    def __init__(self, inner: Application, hosts: set[str], token: str, port: int) -> None:
        self._inner, self._hosts, self._token = inner, hosts, token
        self._cookie = COOKIE.format(port=port)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse and log it."""
        if scope["type"] == "lifespan":
            await self._inner(scope, receive, send)
            return
        if reason := self._refusal(scope):
            await self._refuse(scope, send, 403, reason)
            return
        if scope["type"] == "http":
            whole = await _body(receive)
            if whole is None:
                await self._refuse(scope, send, 413, _TOO_MUCH)
                return
            receive = _again(whole, receive)
        await self._inner(scope, receive, self._with_headers(scope, send))

    async def _refuse(self, scope: Scope, send: Send, status: int, reason: str) -> None:
        client = (scope.get("client") or ("?",))[0]
        _LOG.warning("panel: refused %r from %s: %s", scope.get("path", "?"), client, reason)
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
            return
        headers = [(b"content-type", b"text/plain; charset=utf-8"), *_HEADERS]
        await send({"type": "http.response.start", "status": status, "headers": headers})
        await send({"type": "http.response.body", "body": f"armtempo: {reason}\n".encode()})

    def _refusal(self, scope: Scope) -> str:
        """Why the request is refused; "" if it is not."""
        if not str(scope.get("path", "")).isprintable():
            return "the path has characters that cannot be printed"
        headers = {name.lower(): value.decode("latin-1") for name, value in scope["headers"]}
        if reason := self._foreign(scope, headers):
            return reason
        length = headers.get(b"content-length", "0")
        if not (length.isascii() and length.isdigit()) or int(length) > MOST_BYTES:
            return _TOO_MUCH
        given = [_in_query(scope), self._in_cookie(headers)]
        if not any(hmac.compare_digest(text, self._token) for text in given):
            return (
                "the token is missing or wrong; use the address that 'armtempo panel' printed when it started"
            )
        return ""

    def _foreign(self, scope: Scope, headers: dict[bytes, str]) -> str:
        """Why the request is not one of the server's own pages; "" if it is."""
        host, origin = headers.get(b"host", ""), headers.get(b"origin", "")
        if _name(host) not in self._hosts:
            return (
                f"the panel does not serve the name {host!r}; use the address that 'armtempo panel' printed"
            )
        if scope["type"] == "websocket" and not origin:
            return "the connection names no page that it comes from"
        if origin and _place(origin) != host:
            return "the request comes from a page of another origin"
        navigates = headers.get(b"sec-fetch-mode", "") == "navigate" and _in_query(scope)
        if headers.get(b"sec-fetch-site", "") in ("cross-site", "same-site") and not navigates:
            return "the request comes from a page of another site"
        return ""

    def _in_cookie(self, headers: dict[bytes, str]) -> str:
        """The token in the cookie; "" if there is none."""
        try:
            cookie = SimpleCookie(headers.get(b"cookie", "")).get(self._cookie)
        except CookieError:
            return ""
        return cookie.value if cookie and cookie.value.isascii() else ""

    def _with_headers(self, scope: Scope, send: Send) -> Send:
        """Store the token of the address in a cookie for further requests of the page; add the headers of safety."""
        added = list(_HEADERS)
        if _in_query(scope):
            cookie = f"{self._cookie}={self._token}; HttpOnly; SameSite=Strict; Path=/"
            added.append((b"set-cookie", cookie.encode()))

        async def send_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", []), *added]}
            await send(message)

        return send_headers


class Policy:
    """ASGI middleware that lets pages run no script but the server's own.

    Every script of a page gets a number that is used once; text that looks like a script cannot have it.
    """

    def __init__(self, inner: Application) -> None:
        self._inner = inner

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Give the scripts of a page their number; everything else passes."""
        if scope["type"] != "http":
            await self._inner(scope, receive, send)
            return
        nonce = secrets.token_urlsafe(_NONCE)
        start: list[Message] = []
        parts: list[bytes] = []

        async def send_page(message: Message) -> None:
            if message["type"] == "http.response.start" and _is_page(message):
                start.append(message)
            elif start and message["type"] == "http.response.body":
                parts.append(message.get("body", b""))
                if not message.get("more_body", False):
                    body = b"".join(parts).replace(b"<script", f'<script nonce="{nonce}"'.encode())
                    await send({**start[0], "headers": _page_headers(start[0], len(body), nonce, scope)})
                    await send({"type": "http.response.body", "body": body})
            else:
                await send(message)

        await self._inner(scope, receive, send_page)


def _is_page(start: Message) -> bool:
    """Whether a response is a page without a policy of its own."""
    headers = {name.lower(): value for name, value in start.get("headers", [])}
    return b"content-security-policy" not in headers and headers.get(b"content-type", b"").startswith(
        b"text/html"
    )


def _page_headers(start: Message, length: int, nonce: str, scope: Scope) -> list[tuple[bytes, bytes]]:
    headers = {name.lower(): value for name, value in scope["headers"]}
    socket = "ws://" + headers.get(b"host", b"").decode("latin-1")  # 'self' has it in new browsers only
    policy = POLICY.format(nonce=nonce, socket=socket)
    kept = [one for one in start.get("headers", []) if one[0].lower() != b"content-length"]
    return [
        *kept,
        (b"content-length", str(length).encode()),
        (b"content-security-policy", policy.encode("latin-1")),
    ]


async def _body(receive: Receive) -> Message | None:
    """The body of a request as one message; None if it is too large, even without a length header."""
    parts: list[bytes] = []
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return message
        parts.append(message.get("body", b""))
        if sum(map(len, parts)) > MOST_BYTES:
            return None
        if not message.get("more_body", False):
            return {"type": "http.request", "body": b"".join(parts), "more_body": False}


def _again(first: Message, receive: Receive) -> Receive:
    """A receive function that returns ``first`` again, then further messages."""
    waiting = [first]

    async def received() -> Message:
        return waiting.pop() if waiting else await receive()

    return received


def _name(host: str) -> str:
    """The name in a Host header, without the port; "" for what is no host."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _place(origin: str) -> str:
    """Host and port of an Origin header; "" for what is no origin."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ""


def _in_query(scope: Scope) -> str:
    """The token in the address; "" if there is none."""
    found = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [])
    return found[-1] if found and found[-1].isascii() else ""
