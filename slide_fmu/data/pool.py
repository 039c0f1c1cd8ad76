"""Worker processes simulate in parallel; they never outlive the process that started them.

Without workers, this process does their work. Ctrl-C in a terminal reaches all processes: workers
ignore it, and end with the pool, which their parent then ends.
"""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import closing, contextmanager
from multiprocessing.connection import Connection, wait
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

Result = TypeVar("Result")


@contextmanager
def process_pool(workers: int | None = None) -> Iterator[Executor | None]:
    """Open a pool of processes, one per core if None, that end with their parent, however it ends.

    The pool is shut down at the end of the ``with`` block after the running jobs, or at once if
    the user interrupts the block. With 0 workers there is no pool.
    """
    if workers == 0:
        yield None
        return
    # "spawn": a forked worker would inherit threads and solver states in an undefined condition
    context = multiprocessing.get_context("spawn")
    count = workers or os.cpu_count() or 1
    open_while_wanted, wanted = context.Pipe(duplex=False)
    with (
        TemporaryDirectory(prefix="slide_fmu_workers_", ignore_cleanup_errors=True) as folder,
        open_while_wanted,
        wanted,
        _Pool(
            count,
            mp_context=context,
            initializer=_start,
            initargs=(open_while_wanted, folder),
        ) as pool,
    ):
        try:
            yield pool
        except KeyboardInterrupt:
            pool.leave(wanted)
            raise


class _Pool(ProcessPoolExecutor):
    """A pool whose workers start when there are jobs for them, and ignore Ctrl-C from then on."""

    def submit(self, fn: Callable[..., Result], /, *args: Any, **kwargs: Any) -> Future[Result]:
        with _interrupts_held():
            return super().submit(fn, *args, **kwargs)

    def leave(self, wanted: Connection[Any, Any]) -> None:
        """End the workers at once: they do so when the connection closes.

        Waiting jobs are cancelled first, since a pool whose workers end would raise errors for
        them.
        """
        manager = getattr(self, "_executor_manager_thread", None)
        self.shutdown(wait=False, cancel_futures=True)
        wanted.close()
        if manager is not None:  # it must live until it knows that the workers have ended
            manager.join()


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C back until the block has ended, also from processes that are started there.

    They inherit the mask of this thread; Windows has none.
    """
    heard: list[int] = []
    handler = signal.getsignal(signal.SIGINT)
    # another thread, as of numpy, may take the signal: it would stop this one in the middle
    holds = handler is not None and threading.current_thread() is threading.main_thread()
    if holds:
        signal.signal(signal.SIGINT, lambda number, _: heard.append(number))
    masks = hasattr(signal, "pthread_sigmask")
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    try:
        yield
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if holds:
            signal.signal(signal.SIGINT, handler)
        if heard:
            signal.raise_signal(signal.SIGINT)


def in_parallel(
    pool: Executor | None,
    function: Callable[..., Result],
    jobs: Sequence[tuple[Any, ...]],
    done: Callable[[int], None],
) -> list[Result]:
    """Call a function with the arguments of every job; return the results in the jobs' order.

    ``done`` is called with the number of finished jobs. If a job raises, waiting jobs are left
    out. Without a pool this process does one job after the other.
    """
    results: dict[int, Result] = {}
    with closing(as_done(pool, function, jobs)) as answers:
        for number, result in answers:
            results[number] = result
            done(len(results))
    return [results[number] for number in range(len(jobs))]


def as_done(
    pool: Executor | None,
    function: Callable[..., Result],
    jobs: Iterable[tuple[Any, ...]],
) -> Generator[tuple[int, Result], None, None]:
    """Call a function with the arguments of every job; give number and result of each when done.

    If a job raises, or the caller closes the generator, waiting jobs are left out. Without a pool
    this process does the jobs.
    """
    if pool is None:
        for number, job in enumerate(jobs):
            yield number, function(*job)
        return
    running = {pool.submit(function, *job): number for number, job in enumerate(jobs)}
    try:
        for future in as_completed(running):
            yield running[future], future.result()
    finally:
        for future in running:
            future.cancel()


def _start(open_while_wanted: Connection[Any, Any], folder: str) -> None:
    """Begin a worker; its temporary files lie in the folder, since it may end at any time."""
    tempfile.tempdir = folder
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _end_with_parent(open_while_wanted, folder)


def _end_with_parent(open_while_wanted: Connection[Any, Any], folder: str) -> None:
    parent = multiprocessing.parent_process()

    # a parent that is killed shuts no pool down: each worker watches for its end by itself
    def watch() -> None:
        if parent is not None:
            wait([parent.sentinel, open_while_wanted])
            shutil.rmtree(folder, ignore_errors=True)
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
