"""The panel's server: pages, files of run folders, and a message to all pages ten times per second."""

from __future__ import annotations

import asyncio
import ipaddress
import json
import logging
import socket
import sys
from collections.abc import Callable
from typing import Any

import ifaddr
import uvicorn
from fastapi import FastAPI
from nicegui import Client, app, background_tasks, ui
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, PlainTextResponse

from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.panel import layout, past_runs, words
from armtempo.panel.access import MOST_BYTES, Access, Policy
from armtempo.panel.arm_scene import ArmShape
from armtempo.panel.hold import ButtonHold
from armtempo.panel.panel_board import PanelBoard
from armtempo.report import run_report
from armtempo.report.comparison import PAGE as COMPARISON

_RECONNECT_S = 60.0
"""Time for which a page is kept after its connection breaks (a busy browser, a sleeping tablet)."""
_SWITCH_S = 0.0005
"""How long a thread that computes, such as a plan, keeps the interpreter from others that wait, a stop's among them:
Python's own 5 ms count several times on the way of a press to the board."""
_BUILD_S = 60.0
"""Time for a page to be built, on a machine however busy."""
_KEPT_MESSAGES = 2000
"""Messages kept for such a page: about 15 per second, for up to 132 s until it is dropped."""
_NO_SCRIPTS = {"Content-Security-Policy": "sandbox"}
"""Files of run folders may come from anybody and must not run scripts."""
_EVERYWHERE: dict[str, Callable[[ifaddr.IP], bool]] = {
    "0.0.0.0": lambda ip: ip.is_IPv4,
    "::": lambda ip: ip.is_IPv6 and not ip.ip[2],  # an address of one link needs its interface's name
}
"""Addresses that mean all interfaces, and which of their addresses are meant."""
_LOG = logging.getLogger("armtempo")
_SUFFIXES = (".html", ".svg", ".png", ".csv", ".json")


class Panel:
    """The panel of one board; ``serve`` runs until it is ended."""

    def __init__(self, operator: PanelBoard) -> None:
        self._operator = operator
        self._shape = ArmShape(operator.arm)
        self._hold = ButtonHold(operator)
        self._new: set[str] = set()
        """Pages that have not connected yet."""
        self._api = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
        self._api.get("/runs/{name}/{file}")(self._run_file)
        self._api.get(f"/runs/{COMPARISON}")(self._comparison)
        self._api.get("/mesh/{number}")(self._mesh)
        ui.page("/", response_timeout=_BUILD_S)(self._page)
        app.on_startup(self._tell)
        app.add_middleware(Policy)  # before what packs the pages
        ui.run_with(
            self._api,
            title=words.TITLE,
            dark=None,
            reconnect_timeout=_RECONNECT_S,
            message_history_length=_KEPT_MESSAGES,
            tailwind=False,
            gzip_middleware_factory=lambda inner: GZipMiddleware(inner, compresslevel=1),
        )

    def serve(self, listening: socket.socket, token: str) -> None:
        """Serve on a bound socket; a client needs the ``token``."""
        host, port = listening.getsockname()[:2]
        sys.setswitchinterval(_SWITCH_S)
        guarded = Access(self._api, served_hosts(host), token, port)
        config = uvicorn.Config(
            guarded,
            log_level="warning",
            http="h11",  # the parser that limits the size of headers
            ws_max_size=MOST_BYTES,
            timeout_graceful_shutdown=1,
        )
        uvicorn.Server(config).run(sockets=[listening])

    async def _page(self) -> None:
        client = ui.context.client
        self._new.add(client.id)
        self._offer_control(client.id)
        await layout.build(self._operator, self._hold, self._shape)
        client.on_connect(lambda: self._connected(client.id))
        client.on_disconnect(lambda: self._hold.lost(client.id))
        client.on_delete(lambda: self._gone(client.id))

    def _connected(self, client: str) -> None:
        """A page has connected; one that was loaded again has lost its connection as the page before only now."""
        self._hold.lost(client)
        if client in self._new:
            self._new.discard(client)
            self._offer_control(client)
            Client.instances[client].run_javascript(self._hear())

    def _offer_control(self, client: str) -> None:
        """Give control to a page that comes while no connected page has it."""
        holder = Client.instances.get(self._operator.holder)
        if holder is None or not holder.has_socket_connection:
            self._operator.take_control(client)

    def _gone(self, client: str) -> None:
        """A page was closed, or did not reconnect."""
        self._new.discard(client)
        self._operator.release(client)
        self._operator.monitors.discard(client)
        self._operator.presses.gone(client)

    async def _tell(self) -> None:
        background_tasks.create(self._tell_all())

    async def _tell_all(self) -> None:
        """Compute a message once, and send it to every page."""
        while True:
            await asyncio.sleep(layout.TELL_S)
            if not any(client.has_socket_connection for client in Client.instances.values()):
                continue
            try:
                code = self._hear()
            except Exception:  # a bug: logged; the next message is sent; meanwhile the pages show an overlay
                _LOG.exception("panel: the message to the pages")
                continue
            for client in list(Client.instances.values()):
                if client.has_socket_connection:
                    client.run_javascript(code)

    def _hear(self) -> str:
        """The message to a page, as its script takes it."""
        return f"armtempo.hear({json.dumps(layout.message(self._operator, self._shape))})"

    async def _mesh(self, number: int) -> Any:
        """The mesh of a row of the arm, 0 for the base."""
        file = self._shape.meshes.get(number)
        return FileResponse(file) if file else PlainTextResponse("no such mesh", 404)

    async def _comparison(self, request: Request) -> Any:
        """Make the page that compares the runs of a query."""
        names = request.query_params.getlist("run")
        return await _made(lambda: past_runs.comparison(self._operator.runs, names))

    async def _run_file(self, name: str, file: str) -> Any:
        """Serve a file of a run folder, and no other file."""
        runs = self._operator.runs.resolve()
        path = (runs / name / file).resolve()
        if path.suffix not in _SUFFIXES or not path.is_relative_to(runs):
            return PlainTextResponse("no such file", 404)
        if file == run_report.PAGE:
            return await _made(lambda: past_runs.report(runs, name))
        if not path.is_file():
            return PlainTextResponse("no such file", 404)
        return FileResponse(path, headers=_NO_SCRIPTS)


async def _made(make: Callable[[], bytes]) -> Any:
    """The page that ``make`` makes, in a thread so that no other page waits; why it cannot."""
    try:
        return HTMLResponse(await asyncio.to_thread(make), headers=_NO_SCRIPTS)
    except (ArmtempoError, OSError) as error:
        return PlainTextResponse(words.of_text(str(error)), 422)


def listen(host: str, port: int) -> socket.socket:
    """A socket bound to an address; ``port`` 0: any free port. Raises InputError if that fails."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, reuse_port=False)
    except OSError as error:
        raise InputError(
            f"{host}:{port}: {error.strerror or error}", "choose another --web-port, or --host"
        ) from None


def reachable(host: str) -> list[str]:
    """The addresses at which a server that listens on ``host`` is reached; of all interfaces for 0.0.0.0 and ::."""
    if host not in _EVERYWHERE:
        return [host]
    wanted = _EVERYWHERE[host]
    found = [
        ip.ip if ip.is_IPv4 else ip.ip[0]
        for adapter in ifaddr.get_adapters()
        for ip in adapter.ips
        if wanted(ip)
    ]
    # this machine's own at the end: another one needs the others
    return sorted(map(str, found), key=lambda address: ipaddress.ip_address(address).is_loopback)


def url(address: str, port: int, token: str) -> str:
    """The page that brings the token."""
    name = f"[{address}]" if ":" in address else address
    return f"http://{name}:{port}/?token={token}"


def served_hosts(host: str) -> set[str]:
    """Addresses and names by which pages may ask a server that listens on ``host``."""
    return {*reachable(host), *_names(host)}


def _names(host: str) -> set[str]:
    """Host names of a server that listens on ``host``."""
    local = {"127.0.0.1", "localhost", "::1"}
    if host not in _EVERYWHERE and ipaddress.ip_address(host).is_loopback:
        return local
    name = socket.gethostname()
    return {*local, name, name.split(".")[0], f"{name.split('.')[0]}.local"}
