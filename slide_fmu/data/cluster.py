"""Workers of a Dask cluster make trajectories on all its machines.

The user starts the cluster before, by hand, by dask-jobqueue or by a container, and it continues
to run afterwards. All its machines share the disk of the trajectories.
"""

from __future__ import annotations

import platform
import re
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from importlib import import_module, metadata
from threading import Event, Thread
from time import monotonic
from typing import Any

SCHEME = "dask://"
CONNECT = 15.0
"""Time in s within which a scheduler must answer."""

ALONE, LOOK = 300.0, 5.0
"""Jobs wait this time in s for a worker once all have gone, and look so often."""


class ClusterError(RuntimeError):
    """A cluster cannot be reached, or its workers have other versions than this process."""


def scheduler_of(text: str) -> str:
    """Return the address of a scheduler as Dask knows it, of ``dask://HOST:PORT``.

    Raises:
        ValueError: the text is of another form.
    """
    if re.fullmatch(rf"{SCHEME}(\[[0-9a-fA-F:]+\]|[\w.-]+):\d{{1,5}}", text) is None:
        raise ValueError(
            f"executor {text!r}; expected {SCHEME}HOST:PORT, as {SCHEME}127.0.0.1:8786, the "
            "address of a Dask scheduler; without --executor processes of this machine work"
        )
    return f"tcp://{text.removeprefix(SCHEME)}"


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Connect to the cluster whose scheduler has an address, ``dask://HOST:PORT``.

    Workers may come and go: a job whose worker dies is given to another one. Where there are no
    workers yet, jobs wait for them; once all have gone, they wait for five minutes.

    Raises:
        ValueError: the address is of another form.
        ClusterError: the package is not installed, the scheduler does not answer or goes away, a
            worker has another version of this package, jobs end every worker that tries them, or
            no worker is left.
    """
    scheduler = scheduler_of(address)
    try:
        distributed: Any = import_module("distributed")
    except ModuleNotFoundError as error:
        raise ClusterError(
            f"executor {address!r} needs the package {error.name!r}, which is not installed: "
            "pip install 'slide-fmu[cluster]'"
        ) from error
    try:
        client = distributed.Client(scheduler, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(
            f"executor {address!r} does not answer within {CONNECT:g} s ({error}); expected a "
            "scheduler of Dask there: start one (dask scheduler --port PORT), or correct the "
            "address"
        ) from error
    with client:
        _require_same_versions(client, address)
        try:
            with _watched(client, distributed.Future) as left_alone:
                yield client.get_executor(pure=False)
        except distributed.KilledWorker as error:
            raise ClusterError(
                f"executor {address!r}: {error.allowed_failures + 1} workers died over the same "
                f"trajectories, the last on {error.last_worker.address}; expected a model "
                "that does not end its process, and enough memory for it: see what the workers "
                "wrote; trajectories that were made stay"
            ) from error
        except (CancelledError, distributed.client.FutureCancelledError) as error:
            if left_alone.is_set():
                raise ClusterError(
                    f"executor {address!r}: all its workers went, and none came within {ALONE:g} "
                    "s; expected workers, and a model that does not end its process: see what "
                    "they wrote, start workers, and run the command again; trajectories that "
                    "were made stay"
                ) from error
            raise ClusterError(
                f"executor {address!r}: the connection to the scheduler was lost; "
                "trajectories that were made stay: start the scheduler, and run the command again"
            ) from error


@contextmanager
def _watched(client: Any, future: Any) -> Iterator[Event]:
    """Cancel all jobs of a client once no worker is left for long; the event is set before."""
    left_alone, ended = Event(), Event()

    def watch() -> None:
        seen, last = False, monotonic()
        while not ended.wait(LOOK):
            try:
                there = bool(client.nthreads())
            except Exception:  # the connection is lost, which the jobs tell
                return
            if there or not seen:
                seen, last = seen or there, monotonic()
            elif monotonic() - last > ALONE:
                left_alone.set()
                jobs = [future(key, client) for key in list(client.futures)]
                client.cancel(jobs, force=True)

    watcher = Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield left_alone
    finally:
        ended.set()
        watcher.join()


def versions_here() -> dict[str, str]:
    """Return the versions that a worker must share with this process."""
    python = ".".join(platform.python_version_tuple()[:2])
    return {"slide-fmu": metadata.version("slide-fmu"), "Python": python}


def _require_same_versions(client: Any, address: str) -> None:
    """Refuse connected workers with other versions, or without this package."""
    try:
        of_workers = client.run(versions_here)
    except ModuleNotFoundError as error:
        raise ClusterError(
            f"executor {address!r}: a worker lacks the package {error.name!r}; expected the same "
            "environment as here: install it there, and restart the worker"
        ) from error
    expected = versions_here()
    for worker, versions in of_workers.items():
        if versions != expected:
            raise ClusterError(
                f"executor {address!r}: the worker {worker} has {versions}; expected {expected}, "
                "as here: install the same there, and restart the worker"
            )
