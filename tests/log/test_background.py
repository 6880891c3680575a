"""Calls that another thread carries out: in order, few behind, none after a failure."""

import threading
from time import sleep

import pytest

from mjspace.log.background import Background


def test_calls_are_carried_out_in_order_by_one_other_thread() -> None:
    done: list[tuple[int, int]] = []
    background = Background("log", 3)
    for k in range(20):
        background.call(lambda k=k: done.append((k, threading.get_ident())))
    background.wait()
    assert [k for k, _ in done] == list(range(20))
    assert {thread for _, thread in done} - {threading.get_ident()} == {done[0][1]}
    background.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("log")]


def test_a_call_waits_while_as_many_as_allowed_are_not_done() -> None:
    go = threading.Event()
    made: list[int] = []

    def make() -> None:
        for k in range(4):
            background.call(go.wait, 10.0)
            made.append(k)

    background = Background("log", 2)
    maker = threading.Thread(target=make)
    maker.start()
    while len(made) < 2:
        sleep(0.001)
    sleep(0.02)
    assert made == [0, 1]
    go.set()
    maker.join()
    background.close()
    assert made == [0, 1, 2, 3]


def test_after_a_failure_nothing_is_carried_out_and_everything_raises_it() -> None:
    done: list[int] = []

    def fail() -> None:
        sleep(0.01)
        raise OSError("full")

    background = Background("log", 3)
    background.call(fail)
    background.call(done.append, 1)
    background.call(done.append, 2)
    for again in (background.wait, lambda: background.call(done.append, 3), background.close):
        with pytest.raises(OSError, match="full"):
            again()
    assert done == []
