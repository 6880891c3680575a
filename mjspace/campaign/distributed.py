"""A campaign flown by the workers of a Dask cluster, which have nothing but mjspace."""

import asyncio
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from logging import CRITICAL, getLogger
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any
from uuid import uuid4

from mjspace.campaign.carried import Carried, carried, unpacked
from mjspace.campaign.flights import Flown, fly_numbers, keep_log, keeps, log_of
from mjspace.campaign.members import Population
from mjspace.campaign.places import write_whole
from mjspace.campaign.same_bits import difference, facts
from mjspace.errors import FlightError, InputError, missing
from mjspace.interrupts import Stop
from mjspace.runner import scratch
from mjspace.runner.output import LOG

CONNECT = 5
"""A scheduler that does not answer within this time is none [s]."""
AHEAD = 4096
"""Blocks that the scheduler holds at most: enough for a thousand cores, and little memory."""
_LOOK = 0.2
"""A request to stop is looked for so often [s]."""
_THREADS = "threads"


@dataclass(frozen=True)
class Cluster:
    """A scheduler, whose workers compute the same bits as this process."""

    address: str
    client: Any
    cores: int
    """Of the workers that were there at first."""

    def fly(
        self, members: Population, parts: Iterable[Sequence[int]], keep: str, out: Path, stop: Stop
    ) -> Iterator[list[Flown]]:
        """Fly the parts of the members, and yield each as it is done, with its logs written.

        A part that was on a worker that is gone flies again on another, and so does a log. Once
        ``stop`` is requested, or the generator is closed, what is left is cancelled.

        Raises:
            InputError: a worker cannot fly them, or would with other bits.
            FlightError: as ``flights.fly_members``; or workers are killed by a part, or the
                scheduler is gone.
            OSError: a log cannot be written.
        """
        run = _Run(self, carried(members))
        blocks = ((_fly, (tuple(part),)) for part in parts)
        owed: dict[int, _Block] = {}
        try:
            run.begin(blocks, AHEAD)
            for result in run.results(stop):
                if isinstance(result, list):
                    failing = [one for one in result if keeps(keep, one)]
                    block = _Block(result, len(failing))
                    owed |= {one.member: block for one in failing}
                    run.begin(((_log, (one,)) for one in failing), len(failing), priority=1)
                    run.begin(blocks, 1)
                else:
                    member, log = result
                    if log:
                        write_whole(log_of(out, member), log)
                    block = owed.pop(member)
                    block.logs -= 1
                if not block.logs:
                    yield block.flown
        finally:
            run.cancel()


@dataclass
class _Block:
    """Members that have flown, and how many of their logs have not arrived yet."""

    flown: list[Flown]
    logs: int


class _Run:
    """The calls of one campaign that a cluster is making."""

    def __init__(self, cluster: Cluster, what: Carried) -> None:
        self._cluster, self._name = cluster, f"mjspace-{uuid4().hex[:8]}"
        self._due: set[Any] = set()
        self._done: SimpleQueue[Any] = SimpleQueue()
        self._number = 0
        # A task, not data of one worker's: it is made again where that worker is killed.
        self._what = cluster.client.submit(
            _carried, what, facts(), key=f"scenario-{self._name}", pure=False
        )

    def begin(self, calls: Iterator[tuple[Any, Any]], most: int, *, priority: int = 0) -> None:
        """Begin so many of the calls."""
        for function, arguments in islice(calls, most):
            self._number += 1
            key = (f"{function.__name__.strip('_')}-{self._name}", self._number)
            future = self._cluster.client.submit(
                function, self._what, *arguments, key=key, pure=False, priority=priority
            )
            self._due.add(future)
            future.add_done_callback(self._done.put)

    def results(self, stop: Stop) -> Iterator[Any]:
        """Yield results as they come, until there are no more or ``stop`` is requested."""
        while self._due and not stop():
            try:
                future = self._done.get(timeout=_LOOK)
            except Empty:
                continue
            self._due.remove(future)
            yield self._result(future)

    def _result(self, future: Any) -> Any:
        from distributed import KilledWorker
        from distributed.client import FutureCancelledError

        address = f"--dask {self._cluster.address}"
        try:
            return future.result()
        except (InputError, FlightError, OSError):
            raise
        except KilledWorker as error:
            raise FlightError(
                f"{address}: workers were killed, one after the other, by the same members: as the "
                "system does for lack of memory"
            ) from error
        except FutureCancelledError as error:
            raise FlightError(
                f"{address}: the scheduler is gone; what is done is kept: the same command goes on"
            ) from error
        except Exception as error:
            message = " ".join(f"{type(error).__name__}: {error}".split())
            raise FlightError(f"{address}: a worker could not fly: {message}") from error

    def cancel(self) -> None:
        """Cancel what has not been done; what a worker is doing it ends for nothing."""
        if self._due and self._cluster.client.status == "running":
            self._cluster.client.cancel(list(self._due))


@contextmanager
def cluster(address: str) -> Iterator[Cluster]:
    """Yield the cluster whose scheduler is at the ``address``, as tcp://host:8786.

    Raises:
        InputError: Dask is not installed, no scheduler answers, or a worker would fly with other
            bits.
    """
    try:
        from distributed import Client
    except ImportError:
        raise missing("--dask", "distributed", "dask") from None
    try:
        asyncio.run(_connect(address))
        client = Client(address, timeout=CONNECT, set_as_default=False, name="mjspace")
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"--dask {address}: no scheduler answers within {CONNECT} s: "
            "'dask scheduler' starts one, and says its address, as tcp://host:8786"
        ) from error
    # It prints tracebacks of a scheduler that is gone, which the campaign reports in one line.
    getLogger("distributed.client").setLevel(CRITICAL)
    with client:
        workers = client.run(_facts, on_error="return")
        for worker, found in workers.items():
            if isinstance(found, Exception):
                found = {"mjspace": f"none ({type(found).__name__}: {found})"}
            _refuse_other(worker, found, facts())
        if not workers:
            warnings.warn(f"--dask {address}: no worker yet: flights wait for one", stacklevel=3)
        yield Cluster(address, client, len(workers))


async def _connect(address: str) -> None:
    """Connect to a scheduler and leave: a client that fails to is left half-made, and may hang.

    Raises:
        OSError: none answers.
        ValueError: it is no address.
    """
    from distributed import Security
    from distributed.comm import connect

    secure = Security().get_connection_args("client")
    await (await connect(address, timeout=CONNECT, **secure)).close()


def _refuse_other(worker: str, theirs: Mapping[str, str], ours: Mapping[str, str]) -> None:
    """Refuse a worker that would fly with other bits, or in several threads."""
    why = difference(theirs, ours)
    if why:
        raise InputError(
            f"worker {worker}: {why}: its flights would have other bits: install there what is "
            "installed here, on the same kind of machine"
        )
    if theirs[_THREADS] != "1":
        raise InputError(
            f"worker {worker}: has {theirs[_THREADS]} threads, and a flight needs a process: start "
            "it with 'dask worker ADDRESS --nworkers auto --nthreads 1'"
        )


def _facts(dask_worker: Any = None) -> dict[str, str]:
    """Return what this worker's bits depend on, and how many calls it makes at a time."""
    from distributed import get_worker

    worker = dask_worker or get_worker()
    return {**facts(), _THREADS: str(worker.state.nthreads)}


def _carried(what: Carried, ours: Mapping[str, str]) -> tuple[Carried, Mapping[str, str]]:
    return what, ours


def _here(what: tuple[Carried, Mapping[str, str]]) -> Population:
    """Return the members to a worker, which may have come after the campaign began."""
    from distributed import get_worker

    from mjspace.simulation import mujoco_warnings

    _refuse_other(get_worker().address, _facts(), what[1])
    mujoco_warnings.silence()
    return unpacked(what[0])


def _fly(what: tuple[Carried, Mapping[str, str]], numbers: tuple[int, ...]) -> list[Flown]:
    return fly_numbers(_here(what), numbers)


def _log(what: tuple[Carried, Mapping[str, str]], one: Flown) -> tuple[int, bytes]:
    """Fly a member into a log; return its number and the log, empty where it could not begin."""
    members = _here(what)
    with scratch.folder() as folder:
        keep_log(members, one, path := folder / LOG)
        return one.member, path.read_bytes() if path.is_file() else b""
