"""Forecasts the disk space and the time that a collection needs, measured on its first samples."""

from __future__ import annotations

import time
from collections.abc import Callable

from gear.contracts.tasks import Sidecar
from gear.dataset.files import inside
from gear.dataset.free_space import check_free_space, free_bytes, size_text
from gear.dataset.layout import sidecar_path
from gear.dataset.sidecar import read_sidecar
from gear.dataset.store import Store
from gear.reporting.progress_text import duration_text
from gear.values.progress import Warn

FIRST = 3
"""Number of samples that the forecast is based on."""

LARGE_BYTES, LONG_S = 2 * 10**9, 1800.0
"""Bytes and seconds above which a collection is announced with its size and time."""


class Forecast:
    """Measures the first samples of a collection; stops it if the disk is too small, and announces the size and
    time of a large one.
    """

    def __init__(
        self, store: Store, missing: int, on_warning: Warn, clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        """Prepares the forecast of a run.

        Args:
            store: writer of the split's files.
            missing: number of samples to be made.
            on_warning: called once with the disk space and the time of a large collection.
            clock_s: clock in seconds, with any zero point.
        """
        self._store, self._missing, self._on_warning, self._clock_s = store, missing, on_warning, clock_s
        self._sizes: list[int] = []
        self._first_s = 0.0

    def sample_done(self, index: int) -> None:
        """Records a finished sample; only the first `FIRST` samples are measured. After the last of them the forecast
        is made: it may raise the error below or call `on_warning`.

        Args:
            index: index of the sample, whose files are measured.

        Raises:
            GearError: the disk has less free space than the missing samples need.
        """
        if len(self._sizes) >= min(FIRST, self._missing):
            return
        if not self._sizes:
            self._first_s = self._clock_s()
        self._sizes.append(_bytes_of(self._store, index))
        if len(self._sizes) == min(FIRST, self._missing):
            self._forecast()

    def _forecast(self) -> None:
        made = len(self._sizes)
        needed = sum(self._sizes) / made * (self._missing - made)
        check_free_space(
            self._store.root,
            needed,
            what=f"the missing ones of {self._missing} samples need",
            advice="collect fewer with --samples N, or give --out on another disk",
        )
        each_s = (self._clock_s() - self._first_s) / max(made - 1, 1)  # the first one includes compiling the world
        left_s = each_s * (self._missing - made)
        if needed > LARGE_BYTES or left_s > LONG_S:
            self._on_warning(
                f"{self._missing} samples need about {size_text(needed)} of the "
                f"{size_text(free_bytes(self._store.root))} that are free, and {duration_text(left_s)}"
            )


def _bytes_of(store: Store, index: int) -> int:
    """Bytes of a sample's files and of its sidecar."""
    path = inside(store.root, sidecar_path(store.split, index))
    sidecar: Sidecar = read_sidecar(path)
    return path.stat().st_size + sum(inside(store.root, name).stat().st_size for name in sidecar.files)
