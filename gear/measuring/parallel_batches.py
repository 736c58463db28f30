"""Runs several batches through one network in parallel, which is faster on a CPU than one batch on all cores."""

from __future__ import annotations

import contextlib
import itertools
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

Submit = Callable[..., "Future[Any]"]
"""A function that takes another function with its arguments and returns a future."""

MOST = 4
"""Largest number of lanes, because each lane holds the activations of its batch; with more cores each lane gets more
threads.
"""


def lanes_of(model: Any) -> int:
    """Number of batches that a model may process at a time: torch's number of threads, at most `MOST`, for gear's
    own models on a
    CPU; 1 on a GPU and for other models.
    """
    torch, network = sys.modules.get("torch"), sys.modules.get("gear.networks.network")
    if torch is None or network is None or not isinstance(model, network.Network) or model.device.type != "cpu":
        return 1
    return max(1, min(MOST, int(torch.get_num_threads())))


@contextlib.contextmanager
def lanes(count: int) -> Iterator[Submit]:
    """Runs submitted functions in a number of threads that share torch's cores.

    Output that is printed meanwhile is redirected to stderr, as always when a plugin runs.
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
