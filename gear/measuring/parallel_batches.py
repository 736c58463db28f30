"""Several batches through one network at a time: on a CPU that is faster than one batch on all of its cores."""

from __future__ import annotations

import contextlib
import itertools
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

Submit = Callable[..., "Future[Any]"]
"""Takes a function and its arguments; gives what will come of it."""

MOST = 4
"""Each lane holds the activations of its batch, so more cores give each lane more threads instead."""


def lanes_of(model: Any) -> int:
    """How many batches a model of gear's own may work on at a time: 1 for a GPU's, and for what is no network of ours.

    The threads that torch would use, at most `MOST`.
    """
    torch, network = sys.modules.get("torch"), sys.modules.get("gear.networks.network")
    if torch is None or network is None or not isinstance(model, network.Network) or model.device.type != "cpu":
        return 1
    return max(1, min(MOST, int(torch.get_num_threads())))


@contextlib.contextmanager
def lanes(count: int) -> Iterator[Submit]:
    """Runs what is submitted in so many threads, which share torch's cores.

    What is printed meanwhile goes to stderr, as it does wherever a plugin works.
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
