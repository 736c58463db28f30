"""Pictures of areas as runs of equal pixels: some tens of thousands where there are two million pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Box = tuple[int, int, int, int]
"""First column, first row, and one past the last column and row."""

STRIP_ROWS = 64
"""Pictures are compared in strips of so many rows: what is put down in between stays in the processor's cache."""


@dataclass(frozen=True, slots=True, eq=False)
class Runs:
    """The runs of a picture in reading order; each lies in one row.

    Attributes:
        shape: height and width of the picture.
        values: (N,) what each run's pixels hold.
        starts: (N,) place of its first pixel, counted through the rows.
        lengths: (N,) its pixels.
    """

    shape: tuple[int, int]
    values: npt.NDArray[Any]
    starts: Ints
    lengths: Ints

    @staticmethod
    def of(picture: npt.NDArray[Any]) -> Runs:
        """The runs of an (H, W) picture."""
        height, width = picture.shape
        found = []
        begins = np.ones((min(STRIP_ROWS, height), width), np.bool_)
        for top in range(0, height, STRIP_ROWS):
            strip = picture[top : top + STRIP_ROWS]
            np.not_equal(strip[:, 1:], strip[:, :-1], out=begins[: len(strip), 1:])
            found.append(np.flatnonzero(begins[: len(strip)]) + top * width)
        starts = np.concatenate(found)
        values = np.ascontiguousarray(picture).reshape(-1)[starts]
        return Runs((height, width), values, starts, np.diff(starts, append=height * width))

    def painted(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """The (H, W) picture of the same runs with other values, (N,)."""
        return np.repeat(values, self.lengths).reshape(self.shape)

    def counts(self, size: int) -> Ints:
        """(`size`,) pixels of each value, which must lie in 0..`size` - 1."""
        return np.bincount(self.values, weights=self.lengths, minlength=size).astype(np.int64)

    def boxes(self, keys: npt.NDArray[Any]) -> dict[int, tuple[Box, int]]:
        """The smallest box around all runs of a key, and their pixels.

        Args:
            keys: (N,) of each run; 0 belongs to none.
        """
        used = np.flatnonzero(keys)
        if not used.size:
            return {}
        order = used[np.argsort(keys[used], kind="stable")]
        first = np.flatnonzero(np.diff(keys[order].astype(np.int64), prepend=0))
        row, left = np.divmod(self.starts[order], self.shape[1])
        lengths = self.lengths[order]
        # Runs are in reading order, so a key's first and last row are those of its first and last run.
        last = np.append(first[1:], len(order)) - 1
        begin, end = np.minimum.reduceat(left, first), np.maximum.reduceat(left + lengths, first)
        sides = (begin, row[first], end, row[last] + 1)
        boxes = zip(*(side.tolist() for side in sides), strict=True)
        pixels = np.add.reduceat(lengths, first).tolist()
        return dict(zip(keys[order[first]].tolist(), zip(boxes, pixels, strict=True), strict=True))
