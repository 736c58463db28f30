import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.formats.deflate_runs import compress

runs = st.lists(st.tuples(st.integers(0, 255), st.integers(1, 1200)), min_size=1, max_size=60)


def unpacked(values: list[int], lengths: list[int]) -> bytes:
    return zlib.decompress(compress(np.array(values, np.uint8), np.array(lengths, np.int64)))


@given(runs)
@settings(max_examples=100, deadline=None)
def test_streams_unpack_to_their_runs(pieces: list[tuple[int, int]]) -> None:
    values, lengths = [list(side) for side in zip(*pieces, strict=True)]
    assert unpacked(values, lengths) == b"".join(bytes([v]) * n for v, n in pieces)


@pytest.mark.parametrize("length", [*range(1, 12), *range(255, 264), 516, 517, 518, 519, 520, 100_000])
def test_every_length_of_a_run_is_kept(length: int) -> None:
    assert unpacked([0, 7, 0], [length, length, 1]) == bytes(length) + b"\7" * length + b"\0"


def test_codes_stay_within_fifteen_bits() -> None:
    """Counts that grow like this would give the rarest byte a code of more than twenty."""
    counts = [int(1.7**i) + 1 for i in range(24)]
    values = np.random.default_rng(0).permutation(np.repeat(np.arange(24, dtype=np.uint8), counts))
    data = compress(values, np.ones(len(values), np.int64))
    assert zlib.decompress(data) == values.tobytes()
    assert len(data) < 0.4 * len(values)
