"""The engine that is the calling process itself."""

from __future__ import annotations

from collections.abc import Sequence

from gear.contracts.executors import Report, Work


class InThisProcess:
    """One worker, which is the calling process."""

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        """Makes all items in this process; see `Executor.run`."""
        if indices:
            work(iter(indices), report)
