"""Decodes COCO's compressed run-length strings, which store masks.

Each character holds five bits of a number, lowest bits first; its sixth bit states that more characters follow. From
the third run on, the string stores differences: run n minus run n - 2.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

MOST_CHARACTERS = 7
"""Largest number of characters of one run: 35 bits, enough for more pixels than any picture has."""


def run_lengths(counts: str) -> npt.NDArray[np.int64]:
    """Decodes one of COCO's compressed run-length strings.

    Args:
        counts: the string, as in COCO's `counts`.

    Returns:
        (N,) int64 lengths of the runs in order; the runs are alternately of zeros and of ones, the first one of zeros.

    Raises:
        ValueError: the string is malformed.
    """
    bits = np.frombuffer(counts.encode("ascii"), np.uint8).astype(np.int64) - ord("0")
    if not bits.size:
        return np.zeros(0, np.int64)
    ends = np.flatnonzero(bits & 32 == 0)
    characters = np.diff(ends, prepend=-1)
    if bits.min() < 0 or bits.max() > 63 or not ends.size or ends[-1] != len(bits) - 1:
        raise ValueError("is no string of run lengths")
    if characters.max() > MOST_CHARACTERS:
        raise ValueError("has a run that is longer than any picture")
    begins = ends - characters + 1
    shifts = 5 * (np.arange(len(bits)) - np.repeat(begins, characters))
    values = np.add.reduceat((bits & 31) << shifts, begins)
    values -= np.where(bits[ends] & 16, np.int64(1) << (5 * characters), 0)
    values[1::2] = np.cumsum(values[1::2])
    values[2::2] = np.cumsum(values[2::2])
    if values.min() < 0:
        raise ValueError("has a run that is shorter than nothing")
    return values
