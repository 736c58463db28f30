"""Label maps as runs of equal pixels in a row: tens of thousands of runs instead of two million pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Box = tuple[int, int, int, int]
"""First column, first row, one past the last column, and one past the last row."""

STRIP_ROWS = 64
"""Number of rows that are compared at once. With so few rows, intermediate results stay in the processor's cache."""


@dataclass(frozen=True, slots=True, eq=False)
class Runs:
    """The runs of equal pixels of a picture, in row-major order; a run does not continue in the next row.

    Attributes:
        shape: height and width of the picture.
        values: (N,) value of the pixels in each run.
        starts: (N,) row-major index of each run's first pixel.
        lengths: (N,) number of pixels of each run.
    """

    shape: tuple[int, int]
    values: npt.NDArray[Any]
    starts: Ints
    lengths: Ints

    @staticmethod
    def of(picture: npt.NDArray[Any]) -> Runs:
        """Finds the runs of equal pixels of an (H, W) picture.

        Args:
            picture: (H, W) map of labels or ids.
        """
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
        """An (H, W) picture with the same runs, whose pixels get the new (N,) values.

        Args:
            values: (N,) new value of each run.
        """
        return np.repeat(values, self.lengths).reshape(self.shape)

    def counts(self, size: int) -> Ints:
        """A (`size`,) array with the number of pixels of each value; all values must be in 0..`size` - 1.

        Args:
            size: number of possible values.
        """
        return np.bincount(self.values, weights=self.lengths, minlength=size).astype(np.int64)

    def boxes(self, keys: npt.NDArray[Any]) -> dict[int, tuple[Box, int]]:
        """The bounding box and the number of pixels of each key, from all runs with this key.

        Args:
            keys: (N,) key of each run, such as an object id; runs with key 0 are skipped.

        Returns:
            By key: the box (first column, first row, one past the last column, one past the last row), and the number
                of pixels.
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
