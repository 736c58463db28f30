import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.formats.pixel_runs import Runs

pictures = st.tuples(st.integers(1, 150), st.integers(1, 40), st.integers(0, 2**32 - 1))


@given(pictures)
@settings(max_examples=60, deadline=None)
def test_runs_say_what_the_picture_says(size: tuple[int, int, int]) -> None:
    height, width, seed = size
    rng = np.random.default_rng(seed)
    picture = np.repeat(rng.integers(-1, 5, (height, width)), rng.integers(1, 5), axis=1).astype(np.int32)
    runs = Runs.of(picture)
    np.testing.assert_array_equal(runs.painted(runs.values), picture)
    assert (runs.starts // picture.shape[1] == (runs.starts + runs.lengths - 1) // picture.shape[1]).all()
    assert (Runs.of(picture + 1).counts(6) == [(picture == value).sum() for value in range(-1, 5)]).all()
    found = runs.boxes(np.maximum(runs.values, 0))
    assert sorted(found) == sorted(set(picture[picture > 0].tolist()))
    for key, ((left, top, right, bottom), pixels) in found.items():
        rows, columns = np.nonzero(picture == key)
        assert (left, top, right, bottom) == (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
        assert pixels == len(rows)


def test_a_run_ends_with_its_row() -> None:
    runs = Runs.of(np.full((3, 4), 9, dtype=np.uint8))
    assert (runs.starts.tolist(), runs.lengths.tolist(), runs.values.tolist()) == ([0, 4, 8], [4, 4, 4], [9, 9, 9])


def test_nothing_has_no_boxes() -> None:
    runs = Runs.of(np.zeros((3, 4), dtype=np.uint16))
    assert runs.boxes(runs.values) == {}
