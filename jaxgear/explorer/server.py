"""Server of the page: HTTP for its files, a WebSocket for its answers, and a token in the link that both ask for.

Every connection has a slot for the newest movement, so that nothing queues up; all of them share one `Explorer`.
"""

import asyncio
import contextlib
import hmac
import ipaddress
import json
import secrets
import socket
import subprocess
import sys
import threading
from collections.abc import Awaitable, Callable, Mapping
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

import plotly
import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from ..io.errors import printable
from .explorer import Explorer

LOOPBACK = "127.0.0.1"
_LOOPBACKS = {LOOPBACK, "localhost", "[::1]"}
_PAGE = Path(__file__).with_name("page")
_PLOTLY = Path(plotly.__file__).parent / "package_data" / "plotly.min.js"
_LARGEST = 2**16  # of a message from the page [bytes]
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'"
)
_HEADERS = {
    "Content-Security-Policy": _POLICY,
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
_REFUSED = 4403  # code of a WebSocket that is not let in
_HEIGHT = 760  # in a notebook [px]
_POLL, _SOON = 0.2, 0.02  # [s]


class Ended(Exception):
    """A search was asked to stop."""


class Guard:
    """Let in requests with a known Host, no foreign Origin, and for all but fixed files the token."""

    def __init__(self, app: ASGIApp, token: str, host: str) -> None:
        self._app, self._token, self._host = app, token, host

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] == "lifespan" or not (why := self._refusal(scope)):
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await WebSocket(scope, receive, send).close(_REFUSED, why)
        else:
            await PlainTextResponse(why, 403, _HEADERS)(scope, receive, send)

    def _refusal(self, scope: Scope) -> str:
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        host, origin = headers.get("host", ""), headers.get("origin")
        if not self._knows(host):
            return "unknown Host"
        if origin is not None and origin != f"http://{host}":
            return "foreign Origin"
        given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]
        if scope["path"] not in _FILES and not hmac.compare_digest(given.encode(), self._token.encode()):
            return "the link is incomplete or of an earlier start: open the one that the command prints"
        return ""

    def _knows(self, host: str) -> bool:
        """True for the loopback interface and the address listened on; all interfaces take every number."""
        name = host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() else host
        if name in _LOOPBACKS or name == self._host:
            return True
        if self._host not in ("0.0.0.0", "::"):
            return False
        with contextlib.suppress(ValueError):
            return bool(ipaddress.ip_address(name.strip("[]")))
        return False


_FILES = {
    "/page.js": (_PAGE / "page.js", "text/javascript"),
    "/charts.js": (_PAGE / "charts.js", "text/javascript"),
    "/page.css": (_PAGE / "page.css", "text/css"),
    "/plotly.js": (_PLOTLY, "text/javascript"),
}


class Page:
    """A running page.

    Attributes:
        explorer: what it shows.
        link: address of the page with its token.
    """

    def __init__(self, explorer: Explorer, *, host: str = LOOPBACK, port: int = 0, token: str | None = None) -> None:
        """Listen; `start` or `run` answers.

        Args:
            explorer: opened design file.
            host: address to listen on.
            port: port; 0 for a free one.
            token: secret of the link; None for a random one.

        Raises:
            ValueError: for an address or port that cannot be listened on.
        """
        self.explorer, self._token = explorer, token or secrets.token_urlsafe(24)
        self._stage, self._ready, self._failed = "starting", False, ""
        self._reports: dict[str, Path] = {}
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            self._socket = socket.create_server((host, port), family=family)
        except OSError as error:
            raise ValueError(f"{host}:{port}: cannot be listened on: {error.strerror or error}") from None
        shown = LOOPBACK if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
        self.link = f"http://{shown}:{self._socket.getsockname()[1]}/?token={self._token}"
        routes = [
            Route("/", self._index),
            Route("/report/{name}", self._report_page),
            WebSocketRoute("/answers", self._answers),
            *(Route(path, self._file) for path in _FILES),
        ]
        app = Guard(Starlette(routes=routes), self._token, f"[{host}]" if ":" in host else host)
        options: dict[str, Any] = {"log_level": "critical", "lifespan": "off", "ws_max_size": _LARGEST}
        self._server = uvicorn.Server(uvicorn.Config(app, ws_per_message_deflate=False, **options))
        self._threads = [
            threading.Thread(target=self._server.run, args=([self._socket],), daemon=True),
            threading.Thread(target=self._prepare, daemon=True),
        ]

    def _repr_html_(self) -> str:
        return f'<iframe src="{escape(self.link)}" width="100%" height="{_HEIGHT}" style="border:0"></iframe>'

    def start(self) -> None:
        """Answer from threads in the background."""
        for thread in self._threads:
            thread.start()

    def wait(self, said: Callable[[str], None] = lambda stage: None) -> None:
        """Wait until the page is closed.

        Args:
            said: called with every stage until the page is ready.

        Raises:
            ValueError: if the page cannot be prepared.
        """
        last = ""
        while self._threads[0].is_alive():
            stage = self._stage
            if stage != last:
                said(stage)
                last = stage
            if self._failed:
                raise ValueError(self._failed)
            self._threads[0].join(_POLL)

    def close(self) -> None:
        """End the server at once."""
        self._server.should_exit = self._server.force_exit = True
        self._threads[0].join(2.0)
        self._socket.close()

    def _prepare(self) -> None:
        def stage(text: str) -> None:
            self._stage = text

        try:
            self.explorer.prepare(stage)
        except Exception as error:  # noqa: BLE001 - said by the command and by the page
            self._failed = str(error)
        self._stage, self._ready = ("ready", True) if not self._failed else (self._failed, False)
        if self._ready:
            self.explorer.prepare_rest()

    async def _index(self, request: Request) -> Response:
        return FileResponse(_PAGE / "index.html", media_type="text/html", headers=_HEADERS)

    async def _file(self, request: Request) -> Response:
        path, kind = _FILES[request.url.path]
        return FileResponse(path, media_type=kind, headers=_HEADERS)

    async def _report_page(self, request: Request) -> Response:
        path = self._reports.get(request.path_params["name"])
        if path is None:
            return PlainTextResponse("no such report", 404, _HEADERS)
        own = {**_HEADERS, "Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; img-src data:"}
        return FileResponse(path, media_type="text/html", headers=own)

    async def _answers(self, websocket: WebSocket) -> None:
        await websocket.accept()
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):  # what closes while it is written to
            await self._until_ready(websocket)
            if self._ready:
                await Connection(websocket, self.explorer, self._reports, self._token).run()

    async def _until_ready(self, websocket: WebSocket) -> None:
        last = ""
        while not self._ready:
            if self._stage != last:
                last = self._stage
                await websocket.send_text(_text({"kind": "stage", "text": last, "failed": bool(self._failed)}))
            if self._failed:
                return
            await asyncio.sleep(_POLL)


class Connection:
    """One open page: its newest movement, and its running search and report."""

    def __init__(self, websocket: WebSocket, explorer: Explorer, reports: dict[str, Path], token: str) -> None:
        self._websocket, self._explorer, self._reports, self._token = websocket, explorer, reports, token
        self._newest: Mapping[str, Any] | None = None
        self._moved, self._sending = asyncio.Event(), asyncio.Lock()
        self._stopped = threading.Event()
        self._process: subprocess.Popen[str] | None = None
        self._running: dict[str, asyncio.Task[None]] = {}
        self._kinds: dict[str, Callable[[Mapping[str, Any]], Awaitable[None]]] = {
            "robust": self._robust,
            "optimize": self._optimize,
            "save": self._save,
            "report": self._report,
        }

    async def run(self) -> None:
        """Answer until the page is closed."""
        await self._send({"kind": "start", **self._explorer.start()})
        mover = asyncio.create_task(self._movements())
        try:
            while True:
                await self._take(await self._websocket.receive_text())
        finally:
            self._stopped.set()
            for task in (mover, *self._running.values()):
                task.cancel()
            if self._process is not None:
                self._process.kill()

    async def _take(self, text: str) -> None:
        try:
            message = json.loads(text)
        except (ValueError, RecursionError):
            return await self._refuse("message", "not JSON")
        if not isinstance(message, dict) or not isinstance(message.get("values", {}), dict):
            return await self._refuse("message", "must be an object with a kind")
        kind = message.get("kind")
        if kind in ("move", "rest"):
            self._newest = message
            self._moved.set()
        elif kind == "stop":
            self._stopped.set()
        elif kind in self._kinds:
            running = self._running.get(kind)
            if running is not None and not running.done():
                return await self._refuse(kind, "is running already")
            if kind == "optimize":
                self._stopped = threading.Event()
            self._running[kind] = asyncio.create_task(self._answered(kind, message))
        else:
            await self._refuse("kind", f"must be one of move, rest, stop, {', '.join(self._kinds)}")

    async def _answered(self, kind: str, message: Mapping[str, Any]) -> None:
        try:
            await self._kinds[kind](message)
        except WebSocketDisconnect:
            raise
        except Exception as error:  # noqa: BLE001 - said by the page, which goes on
            await self._refuse(kind, str(error))

    async def _movements(self) -> None:
        """Answer the newest movement or rest, one after the other."""
        while True:
            await self._moved.wait()
            self._moved.clear()
            message, self._newest = self._newest, None
            if message is None:
                continue
            kind, number = message["kind"], message.get("number")
            if kind == "rest" and not self._explorer.rests.is_set():
                await self._send({"kind": "stage", "text": "compiling the finer grid", "failed": False})
            try:
                values = self._explorer.opened.check(message.get("values", {}))
                answer = await asyncio.to_thread(self._explorer.move if kind == "move" else self._rest, values)
            except Exception as error:  # noqa: BLE001 - said by the page, which goes on
                await self._refuse(kind, str(error), number)
                continue
            if answer is not None:
                await self._send({"kind": kind, "number": number, **answer})

    def _rest(self, values: Mapping[str, float]) -> dict[str, Any] | None:
        while not self._explorer.rests.wait(_SOON):
            if self._newest is not None:
                return None
        return self._explorer.rest(values, lambda: self._newest is not None)

    async def _robust(self, message: Mapping[str, Any]) -> None:
        values = self._explorer.opened.check(message.get("values", {}))
        found = await asyncio.to_thread(self._explorer.robust, values)
        await self._send({"kind": "robust", "number": message.get("number"), **found})

    async def _optimize(self, message: Mapping[str, Any]) -> None:
        values = self._explorer.opened.check(message.get("values", {}))
        loop, stopped = asyncio.get_running_loop(), self._stopped

        def progress(step: int, steps: int, best: float | None) -> None:
            if stopped.is_set():
                raise Ended
            said = {"kind": "progress", "step": step, "steps": steps, "best": best}
            asyncio.run_coroutine_threadsafe(self._send(said), loop)

        objective = str(message.get("objective", ""))
        try:
            best = await asyncio.to_thread(self._explorer.optimize, values, objective, progress)
        except Ended:
            best = None
        await self._send({"kind": "optimized", "values": None if stopped.is_set() else best})

    async def _save(self, message: Mapping[str, Any]) -> None:
        values = self._explorer.opened.check(message.get("values", {}))
        files = await asyncio.to_thread(self._explorer.write, str(message.get("name", "")), values)
        await self._send({"kind": "written", "files": files, "folder": str(self._explorer.folder)})

    async def _report(self, message: Mapping[str, Any]) -> None:
        """Write the design file, and its report by the command `analyze` in a process of its own."""
        values = self._explorer.opened.check(message.get("values", {}))
        files = await asyncio.to_thread(self._explorer.write, str(message.get("name", "")), values)
        path = self._explorer.folder / files[0]
        target = path.with_name(f"{path.stem}-report")
        command = [sys.executable, "-m", "jaxgear", "analyze", str(path), "--report", "--output", str(target)]
        pipes: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        self._process = process = subprocess.Popen(command, cwd=path.parent, **pipes)
        _, errors = await asyncio.to_thread(process.communicate)
        self._process = None
        if not (target / "report.html").exists() or process.returncode not in (0, 1):  # 1: flagged in the report
            raise ValueError(errors.strip().splitlines()[-1] if errors.strip() else "ended")
        self._reports[target.name] = target / "report.html"
        files = [*files, f"{target.name}/report.html"]
        link = f"/report/{target.name}?token={self._token}"
        await self._send({"kind": "written", "files": files, "folder": str(self._explorer.folder), "link": link})

    async def _refuse(self, of: str, why: str, number: object = None) -> None:
        await self._send({"kind": "refused", "of": of, "text": printable(" ".join(why.split())), "number": number})

    async def _send(self, message: Mapping[str, Any]) -> None:
        async with self._sending:
            await self._websocket.send_text(_text(message))


def _text(message: Mapping[str, Any]) -> str:
    return json.dumps(message, separators=(",", ":"), allow_nan=False)
