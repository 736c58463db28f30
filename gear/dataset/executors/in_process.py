"""The executor for a single worker: the calling process makes all samples."""

from __future__ import annotations

from collections.abc import Sequence

from gear.contracts.executors import Report, Work


class InThisProcess:
    """An executor without worker processes: the calling process makes all items (samples of a split)."""

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        """Makes all items (samples of a split) in this process.

        Args:
            work: function that makes items.
            indices: indices of the items.
            report: called with the outcome of each item.
        """
        if indices:
            work(iter(indices), report)
