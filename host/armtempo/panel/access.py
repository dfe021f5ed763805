"""Access control of the server: only its own pages, and from other machines only with the token."""

from __future__ import annotations

import hmac
import logging
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

COOKIE = "armtempo_token"
MOST_BYTES = 1_000_000
"""Largest body of a request; a page of via points has a few thousand bytes."""
_TOO_MUCH = f"more than {MOST_BYTES} bytes"
_LOG = logging.getLogger("armtempo")


class Access:
    """ASGI middleware that protects an application.

    ``hosts``: allowed host names, against DNS rebinding; ``token``: required from a client, first in the
    address and then in a cookie; "" on the loopback address, where none is needed.
    """

    def __init__(self, inner: Application, hosts: set[str], token: str) -> None:
        self._inner, self._hosts, self._token = inner, hosts, token

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
        await self._inner(scope, receive, self._with_cookie(scope, send))

    async def _refuse(self, scope: Scope, send: Send, status: int, reason: str) -> None:
        client = (scope.get("client") or ("?",))[0]
        _LOG.warning("panel: refused %r from %s: %s", scope.get("path", "?"), client, reason)
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
            return
        await send(
            {"type": "http.response.start", "status": status, "headers": [(b"content-type", b"text/plain")]}
        )
        await send({"type": "http.response.body", "body": f"armtempo: {reason}\n".encode()})

    def _refusal(self, scope: Scope) -> str:
        """Why the request is refused; "" if it is not."""
        if not str(scope.get("path", "")).isprintable():
            return "the path has characters that cannot be printed"
        headers = {name.lower(): value for name, value in scope["headers"]}
        host = headers.get(b"host", b"").decode("latin-1")
        if _name(host) not in self._hosts:
            return "this name is not the server's"
        origin = headers.get(b"origin", b"").decode("latin-1")
        if origin and urlsplit(origin).netloc != host:
            return "the request comes from a page of another origin"
        length = headers.get(b"content-length", b"0")
        if not length.isdigit() or int(length) > MOST_BYTES:
            return _TOO_MUCH
        if self._token and not any(
            hmac.compare_digest(given, self._token) for given in _given(scope, headers)
        ):
            return "the token is missing or wrong; use the address that 'armtempo panel' printed"
        return ""

    def _with_cookie(self, scope: Scope, send: Send) -> Send:
        """Store the token of the address in a cookie, for further requests of the page."""
        if not self._token or b"token=" not in scope.get("query_string", b""):
            return send

        async def send_cookie(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                cookie = f"{COOKIE}={self._token}; HttpOnly; SameSite=Strict; Path=/".encode()
                message = {**message, "headers": [*message.get("headers", []), (b"set-cookie", cookie)]}
            await send(message)

        return send_cookie


async def _body(receive: Receive) -> MutableMapping[str, Any] | None:
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


def _again(first: MutableMapping[str, Any], receive: Receive) -> Receive:
    """A receive function that returns ``first`` again, then further messages."""
    waiting = [first]

    async def received() -> MutableMapping[str, Any]:
        return waiting.pop() if waiting else await receive()

    return received


def _name(host: str) -> str:
    """The name in a Host header, without the port."""
    return urlsplit(f"//{host}").hostname or ""


def _given(scope: Scope, headers: dict[bytes, bytes]) -> list[str]:
    """The tokens in a request."""
    query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
    found = query.get("token", [])
    try:
        cookie = SimpleCookie(headers.get(b"cookie", b"").decode("latin-1")).get(COOKIE)
    except CookieError:
        cookie = None
    return [text for text in [*found, *([cookie.value] if cookie else [])] if text.isascii()]
