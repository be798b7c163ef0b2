"""The addresses of the page. One thread computes; the others are free to answer."""

from __future__ import annotations

import asyncio
import json
import math
import socket
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler, StaticFileHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from agents.explorer.controls import schema
from agents.explorer.game import FASTEST, SLOWEST, Game
from agents.explorer.presets import presets
from agents.explorer.results import Superseded, Trainer, checkpoint, result, teaching
from agents.explorer.settings import TRIALS, Settings, parse
from gnm_env.checks import whole

PAGE = Path(__file__).parent / "page"
HOSTS = ("127.0.0.1", "localhost")
"""Names by which a browser may call the page: whoever reaches it by another is not on this machine."""
POLICY = "default-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'"
"""The page loads nothing from anywhere else."""
CLOSED = 499
"""Status of an answer that nobody waits for."""


class Work:
    """The trainer, and the one thread that it is used by."""

    def __init__(self) -> None:
        self.trainer = Trainer()
        self._thread = ThreadPoolExecutor(1, "explorer")

    async def do(self, job: Callable[[], Any]) -> Any:
        """The result of `job`, computed in the thread."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, job)

    def warm_up(self) -> None:
        """Compile, or load, what the first page needs."""
        self._thread.submit(lambda: self.trainer.trained(parse({"trials": "100"})))


def require_own_machine(host: str) -> None:
    """HTTPError unless the browser calls the page by a name of its own machine."""
    if urlsplit(f"//{host}").hostname not in HOSTS:
        raise HTTPError(403, reason="this page is served to its own machine only")


class _Handler(RequestHandler):
    """What all addresses share."""

    work: Work

    def initialize(self, work: Work) -> None:
        self.work = work
        self.gone = False

    def prepare(self) -> None:
        require_own_machine(self.request.host)

    def set_default_headers(self) -> None:
        self.set_header("Content-Security-Policy", POLICY)
        self.set_header("Cache-Control", "no-store")
        self.set_header("X-Content-Type-Options", "nosniff")

    def on_connection_close(self) -> None:
        self.gone = True

    def chosen(self) -> Settings:
        """The settings of the address; ValueError if they mean nothing."""
        names = self.request.query_arguments
        return parse({name: self.get_query_argument(name) for name in names})

    def refuse(self, error: Exception) -> None:
        self.set_status(400)
        self.finish({"error": " ".join(str(error).split())})


class _Page(_Handler):
    def get(self) -> None:
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.finish((PAGE / "index.html").read_bytes())


class _Schema(_Handler):
    async def get(self) -> None:
        # In a thread of its own: the trainer's may be compiling.
        found = await asyncio.to_thread(schema)
        self.finish(found | {"presets": presets(), "trials": TRIALS})


class _Computed(_Handler):
    """An answer in JSON that needs a trained agent."""

    def initialize(self, work: Work, compute: Callable[..., dict[str, Any]]) -> None:  # type: ignore[override]
        super().initialize(work)
        self.compute = compute

    async def get(self) -> None:
        try:
            settings = self.chosen()

            def job() -> dict[str, Any]:
                if self.gone:
                    raise Superseded
                trained = self.work.trainer.trained(settings, lambda: self.gone)
                return self.compute(settings, trained)

            found = await self.work.do(job)
        except Superseded:
            self.set_status(CLOSED, "nobody waits for it")
            return
        except (ValueError, MemoryError, OverflowError) as error:
            self.refuse(error)
            return
        self.set_header("Content-Type", "application/json")
        self.finish(json.dumps(finite(found)))


class _Checkpoint(_Handler):
    async def get(self) -> None:
        try:
            settings = self.chosen()
            content = await self.work.do(
                lambda: checkpoint(settings, self.work.trainer.trained(settings))
            )
        except ValueError as error:
            self.refuse(error)
            return
        self.set_header("Content-Type", "application/octet-stream")
        self.set_header("Content-Disposition", 'attachment; filename="agent.npz"')
        self.finish(content)


class _Play(WebSocketHandler):
    """A game: the page sends its wish to begin and then each press, and is sent bin after bin."""

    def initialize(self, work: Work) -> None:
        self._work = work
        self._pressed = 0
        self._task: asyncio.Task[None] | None = None

    def prepare(self) -> None:
        require_own_machine(self.request.host)

    async def on_message(self, message: str | bytes) -> None:  # type: ignore[override]
        said = json.loads(message)
        if "begin" in said:
            self.on_close()
            self._task = asyncio.create_task(self._run(said))
        else:
            self._pressed = 1

    def on_close(self) -> None:
        if self._task is not None:
            self._task.cancel()

    async def _run(self, said: dict[str, Any]) -> None:
        try:
            settings = parse(said["begin"])
            pause = 1.0 / whole("speed", said.get("speed", 20), low=SLOWEST, high=FASTEST)
            seed = whole("seed", said.get("seed", 0), low=0)
            game, score = await self._work.do(lambda: self._new(settings, seed))
            await self._send(begun=True, neuron_score=score, silent=settings.task.silent_score,
                             owed=settings.task.owed)  # fmt: skip
            await self._stream(game, pause)
        except ValueError as error:
            await self._send(error=str(error))
        except WebSocketClosedError:
            return

    def _new(self, settings: Settings, seed: int) -> tuple[Game, int]:
        game = Game(settings, self._work.trainer.trained(settings), seed)
        return game, game.neuron_score()

    async def _stream(self, game: Game, pause: float) -> None:
        """Show a bin, wait, take what was pressed meanwhile as its answer; and so on."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        self._pressed = 0
        while not game.over:
            await self._send(**game.look())
            due = max(due + pause, loop.time())
            await asyncio.sleep(due - loop.time())
            spike, self._pressed = self._pressed, 0
            await self._send(spike=spike, **game.answer(spike))

    async def _send(self, **what: Any) -> None:
        await self.write_message(json.dumps(finite(what)))


def finite(value: Any) -> Any:
    """`value` as browsers can read it: what is infinite or no number becomes null."""
    if isinstance(value, dict):
        return {key: finite(one) for key, one in value.items()}
    if isinstance(value, list):
        return [finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def application(work: Work) -> Application:
    """The addresses of the page."""
    return Application(
        [
            ("/", _Page, {"work": work}),
            ("/api/schema", _Schema, {"work": work}),
            ("/api/result", _Computed, {"work": work, "compute": result}),
            ("/api/teaching", _Computed, {"work": work, "compute": teaching}),
            ("/agent.npz", _Checkpoint, {"work": work}),
            ("/api/play", _Play, {"work": work}),
            ("/page/(.*)", StaticFileHandler, {"path": str(PAGE)}),
        ],
        websocket_ping_interval=20,
        log_function=lambda handler: None,
    )


async def serve(port: int, ready: Callable[[str], None]) -> None:
    """Serve until cancelled; `ready` is given the address. Port 0: any that is free.

    Raises OSError if the port is taken.
    """
    sockets = bind_sockets(port, "127.0.0.1", socket.AF_INET)
    work = Work()
    server = HTTPServer(application(work))
    server.add_sockets(sockets)
    work.warm_up()
    ready(f"http://127.0.0.1:{sockets[0].getsockname()[1]}/")
    try:
        await asyncio.Event().wait()
    finally:
        server.stop()
