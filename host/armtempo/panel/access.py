"""Who may ask the server for anything: pages of its own only, and from other machines only those with the token."""

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
"""Of the body of a request; a page of via points has a few thousand."""
_LOG = logging.getLogger("armtempo")


class Access:
    """An ASGI application around another, which it guards.

    ``hosts``: names by which the server may be called, against DNS rebinding; ``token``: what a client must show,
    once in the address and then in a cookie; "" on the loopback address, where none is needed.
    """

    def __init__(self, inner: Application, hosts: set[str], token: str) -> None:
        self._inner, self._hosts, self._token = inner, hosts, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Hand a request on, or refuse and log it."""
        if scope["type"] == "lifespan":
            await self._inner(scope, receive, send)
            return
        reason = self._refusal(scope)
        if not reason:
            await self._inner(scope, receive, self._with_cookie(scope, send))
            return
        client = (scope.get("client") or ("?",))[0]
        _LOG.warning("panel: refused %s from %s: %s", scope.get("path", "?"), client, reason)
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
            return
        await send(
            {"type": "http.response.start", "status": 403, "headers": [(b"content-type", b"text/plain")]}
        )
        await send({"type": "http.response.body", "body": f"armtempo: {reason}\n".encode()})

    def _refusal(self, scope: Scope) -> str:
        """Why the request is refused; "" if it is not."""
        headers = {name.lower(): value for name, value in scope["headers"]}
        host = headers.get(b"host", b"").decode("latin-1")
        if _name(host) not in self._hosts:
            return "this name is not the server's"
        origin = headers.get(b"origin", b"").decode("latin-1")
        if origin and urlsplit(origin).netloc != host:
            return "the request comes from a page of another origin"
        length = headers.get(b"content-length", b"0")
        if not length.isdigit() or int(length) > MOST_BYTES:
            return f"more than {MOST_BYTES} bytes"
        if self._token and not any(
            hmac.compare_digest(given, self._token) for given in _given(scope, headers)
        ):
            return "the token is missing or wrong; use the address that 'armtempo panel' printed"
        return ""

    def _with_cookie(self, scope: Scope, send: Send) -> Send:
        """Keep the token of the address in a cookie, for what the page asks for."""
        if not self._token or b"token=" not in scope.get("query_string", b""):
            return send

        async def send_cookie(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                cookie = f"{COOKIE}={self._token}; HttpOnly; SameSite=Strict; Path=/".encode()
                message = {**message, "headers": [*message.get("headers", []), (b"set-cookie", cookie)]}
            await send(message)

        return send_cookie


def _name(host: str) -> str:
    """The name in a Host header, without the port."""
    return urlsplit(f"//{host}").hostname or ""


def _given(scope: Scope, headers: dict[bytes, bytes]) -> list[str]:
    """The tokens that a request shows."""
    query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
    found = query.get("token", [])
    try:
        cookie = SimpleCookie(headers.get(b"cookie", b"").decode("latin-1")).get(COOKIE)
    except CookieError:
        cookie = None
    return [text for text in [*found, *([cookie.value] if cookie else [])] if text.isascii()]
