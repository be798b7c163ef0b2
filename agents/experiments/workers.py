"""Where blocks are computed: threads of this process, or a running Dask cluster.

Both are executors of `concurrent.futures`, so that the sweep need not know which it has.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from agents.experiments.design import Block
from agents.training.many import thread_count

CONNECTION_SECONDS = 5
"""How long a scheduler may take to answer."""


Outcome = tuple[Mapping[str, Any], float, str]
"""A finished block: its arrays, how many seconds it took, and the machine that computed it."""


def timed(compute: Callable[[Block], Mapping[str, Any]], block: Block) -> Outcome:
    """Compute a block. Runs in the worker."""
    start = time.monotonic()
    values = compute(block)
    return values, time.monotonic() - start, socket.gethostname()


@contextmanager
def threads(count: int | None = None) -> Iterator[Executor]:
    """`count` threads, one per core by default. The compiled loops do not hold the GIL."""
    executor = ThreadPoolExecutor(thread_count(count), thread_name_prefix="block")
    try:
        yield executor
    finally:
        executor.shutdown(wait=False, cancel_futures=True)


def lost(error: Exception) -> bool:
    """Whether an error says that a worker or the scheduler is gone, not that a block failed."""
    gone = (CancelledError, BrokenExecutor, ConnectionError, TimeoutError)
    # Dask's own, by name: it may not be installed.
    return isinstance(error, gone) or type(error).__module__.startswith("distributed.")


@contextmanager
def cluster(address: str, modules: Sequence[str] = ()) -> Iterator[Executor]:
    """The Dask cluster whose scheduler listens at `address`, such as "tcp://node1:8786".

    Its workers need the packages `gnm_env` and `agents`, of the same version; the files `modules`
    are sent to them. A worker that dies costs the block it was at: the scheduler gives that block
    to another worker.

    Raises ValueError if Dask is not installed, or if no scheduler answers.
    """
    try:
        import distributed
    except ImportError:
        raise ValueError(
            '--scheduler needs Dask, which is not installed: pip install "gnm-env[cluster]"'
        ) from None
    _knock(address)
    # A lost scheduler is said by the sweep, in a line; Dask would log tracebacks before it.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    with (
        distributed.Client(address, set_as_default=False) as client,
        client.get_executor(pure=False) as executor,
    ):
        for path in modules:
            client.upload_file(path)
        yield executor


def _knock(address: str) -> None:
    """Raise ValueError unless a Dask scheduler answers at `address`.

    A connection of its own: a Client that cannot connect complains again when it is collected.
    """
    from distributed.comm import connect
    from distributed.security import Security

    async def knock() -> None:
        security = Security().get_connection_args("client")  # certificates, for tls://
        comm = await connect(address, timeout=CONNECTION_SECONDS, **security)
        await comm.close()

    try:
        asyncio.run(knock())
    except Exception as error:  # anything at all, if it is something else that answers there
        known = isinstance(error, (OSError, ValueError))
        raise ValueError(
            f"no Dask scheduler answers at {address} "
            f"({error if known else 'what listens there is none'}): start one with `dask "
            "scheduler`, or leave --scheduler out"
        ) from None
