"""Runs several batches through one network in parallel, each in a lane (a thread of its own).

On a CPU this is faster than one batch on all cores.
"""

from __future__ import annotations

import contextlib
import itertools
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

Submit = Callable[..., "Future[Any]"]
"""Type of a function that submits a call (function and arguments) to a thread and returns its future."""

MOST = 4
"""Largest number of lanes (batches that are processed in parallel). It is small because each lane holds the activations
of its batch; with more cores each lane gets more threads.
"""


def lanes_of(model: Any) -> int:
    """The number of batches that a model may process in parallel.

    It is torch's number of threads, at most `MOST`, for gear's own models on a CPU, and 1 for all other models.
    """
    torch, network = sys.modules.get("torch"), sys.modules.get("gear.networks.network")
    if torch is None or network is None or not isinstance(model, network.Network) or model.device.type != "cpu":
        return 1
    return max(1, min(MOST, int(torch.get_num_threads())))


@contextlib.contextmanager
def lanes(count: int) -> Iterator[Submit]:
    """A context with threads for parallel batches; yields the function that submits a call to them.

    Each thread gets an equal share of torch's threads. Output that is printed inside the context goes to stderr.

    Args:
        count: number of threads.
    """
    import torch

    threads = torch.get_num_threads()
    shares = itertools.chain([threads // count + 1] * (threads % count), itertools.repeat(threads // count))

    def begin() -> None:
        torch.get_num_threads()  # torch sets a thread up at its first look, and would undo what was set before
        torch.set_num_threads(next(shares))

    pool = ThreadPoolExecutor(count, initializer=begin)
    try:
        with contextlib.redirect_stdout(sys.stderr), pool:  # one redirection for all: threads share stdout
            try:
                yield pool.submit
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
    finally:
        torch.set_num_threads(threads)
