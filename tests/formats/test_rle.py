import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pycocotools import mask as coco_mask

from gear.formats import rle

pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")


@st.composite
def masks(draw: st.DrawFn) -> np.ndarray:
    height, width = draw(st.integers(1, 40)), draw(st.integers(1, 40))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return rng.random((height, width)) < draw(st.sampled_from([0.0, 0.05, 0.5, 0.95, 1.0]))


@given(masks())
@settings(max_examples=150, deadline=None)
def test_runs_are_pycocotools_own(mask: np.ndarray) -> None:
    official = coco_mask.encode(np.asfortranarray(mask.astype(np.uint8)))
    counts = rle.encode(mask)
    assert counts.encode() == official["counts"]
    np.testing.assert_array_equal(rle.decode(counts, *mask.shape), mask)
    assert coco_mask.area(official) == mask.sum()


@given(masks(), st.integers(0, 5), st.integers(0, 5), st.integers(0, 5), st.integers(0, 5))
@settings(max_examples=100, deadline=None)
def test_crops_are_placed(crop: np.ndarray, left: int, top: int, right: int, bottom: int) -> None:
    whole = np.pad(crop, ((top, bottom), (left, right)))
    assert rle.encode_crop(crop, left, top, *whole.shape) == rle.encode(whole)


def test_long_runs_survive() -> None:
    mask = np.zeros((1024, 2048), dtype=np.bool_)
    mask[3:900, 700:1900] = True
    np.testing.assert_array_equal(rle.decode(rle.encode(mask), 1024, 2048), mask)


def test_a_mask_outside_is_refused() -> None:
    with pytest.raises(ValueError, match="leaves the picture"):
        rle.encode_crop(np.ones((4, 4), dtype=np.bool_), 7, 0, 10, 10)
    with pytest.raises(ValueError, match="fill 100 pixels"):
        rle.decode(rle.encode(np.ones((10, 10), dtype=np.bool_)), 5, 5)
