"""Worker processes simulate in parallel; they never outlive the process that started them.

Where there shall be none, this process does their work.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import closing, contextmanager
from itertools import islice
from queue import SimpleQueue
from typing import Any, TypeVar

from slide_fmu.systems import given

Result = TypeVar("Result")

IN_FLIGHT = 4096
"""So many jobs are with a pool at a time: enough for a thousand workers, and little memory."""


@contextmanager
def process_pool(
    workers: int | None = None,
    set_up: Callable[..., object] | None = None,
    arguments: tuple[Any, ...] = (),
) -> Iterator[Executor | None]:
    """Open a pool of processes, one per core if None, that end with their parent, however it ends.

    ``set_up`` is called once in every worker with the arguments, which must be picklable; systems
    that were given as objects are given there too. The pool is shut down at the end of the
    ``with`` block. No workers, 0, are no pool: then this process is set up.
    """
    if workers == 0:
        if set_up is not None:
            set_up(*arguments)
        yield None
        return
    # "spawn": a forked worker would inherit threads and solver states in an undefined condition
    context = multiprocessing.get_context("spawn")
    count = workers or os.cpu_count() or 1
    with ProcessPoolExecutor(
        count,
        mp_context=context,
        initializer=_start,
        initargs=(given.crossing(), set_up, arguments),
    ) as pool:
        yield pool


def in_parallel(
    pool: Executor | None,
    function: Callable[..., Result],
    jobs: Sequence[tuple[Any, ...]],
    done: Callable[[int], None],
) -> list[Result]:
    """Call a function with the arguments of every job; return the results in the jobs' order.

    ``done`` hears how many are done. Where one raises, those that have not begun are left out.
    Without a pool this process does one job after the other.
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

    At most ``IN_FLIGHT`` jobs are with the pool at a time, so that there may be millions. Where
    one raises, or who asked closes the generator, those that have not begun are left out. Without
    a pool this process does them.
    """
    waiting = iter(enumerate(jobs))
    if pool is None:
        for number, job in waiting:
            yield number, function(*job)
        return
    running: dict[Future[Result], int] = {}
    finished: SimpleQueue[Future[Result]] = SimpleQueue()

    def begin(most: int) -> None:
        for number, job in islice(waiting, most):
            future = pool.submit(function, *job)
            running[future] = number
            future.add_done_callback(finished.put)

    try:
        begin(IN_FLIGHT)
        while running:
            future = finished.get()
            yield running.pop(future), future.result()
            begin(1)
    finally:
        for future in running:
            future.cancel()


def _start(
    crossed: bytes, set_up: Callable[..., object] | None, arguments: tuple[Any, ...]
) -> None:
    _end_with_parent()
    given.take(crossed)
    if set_up is not None:
        set_up(*arguments)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()

    # a parent that is killed shuts no pool down: each worker watches for its end by itself
    def wait() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
