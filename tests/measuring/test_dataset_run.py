"""The queue of samples to measure."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from gear.measuring.dataset_run import _BoundedQueue
from gear.measuring.scoring import SampleResult


def note(index: int) -> SampleResult:
    return SampleResult(index=index, metrics={}, parts={}, cost={}, score=None, mask=None, facts={}, sha256={})


def test_finished_samples_are_counted_and_other_results_are_not() -> None:
    done: list[int] = []
    with ThreadPoolExecutor(2) as pool:
        queue = _BoundedQueue(pool, 2, lambda: done.append(1))
        found = [queue.submit(note, index) for index in range(5)]
        queue.submit(lambda: "no note").result()
        assert [future.result().index for future in found] == list(range(5))
    queue.check()
    assert len(done) == 5


def test_the_first_failure_is_raised() -> None:
    def fail(index: int) -> SampleResult:
        raise ValueError(f"sample {index}")

    with ThreadPoolExecutor(1) as pool:
        queue = _BoundedQueue(pool, 2, lambda: None)
        for index in range(2):
            queue.submit(fail, index)
    with pytest.raises(ValueError, match="sample 0"):
        queue.check()


def test_a_failing_callback_is_not_lost() -> None:
    def done() -> None:
        raise RuntimeError("callback")

    with ThreadPoolExecutor(1) as pool:
        queue = _BoundedQueue(pool, 1, done)
        queue.submit(note, 0)
    with pytest.raises(RuntimeError, match="callback"):
        queue.check()


def test_no_more_jobs_wait_than_allowed() -> None:
    may_go, second_submitted = threading.Event(), threading.Event()

    def wait(index: int) -> SampleResult:
        may_go.wait(10)
        return note(index)

    with ThreadPoolExecutor(1) as pool:
        queue = _BoundedQueue(pool, 1, lambda: None)
        queue.submit(wait, 0)

        def submit_another() -> None:
            queue.submit(wait, 1)
            second_submitted.set()

        thread = threading.Thread(target=submit_another)
        thread.start()
        assert not second_submitted.wait(0.1)
        may_go.set()
        assert second_submitted.wait(10)
        thread.join()
