import io

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from gear.formats.cityscapes import COLOURS_RGBA, colour_map
from gear.formats.label_png import encode_label_map, encode_painted
from gear.formats.png import decode_plain, encode_labels

sizes = st.tuples(st.integers(1, 150), st.integers(1, 60), st.sampled_from([1, 3, 20]), st.integers(0, 2**32 - 1))


def areas(height: int, width: int, blocks: int, seed: int, high: int) -> npt.NDArray[np.int64]:
    """Squares of equal labels, `blocks` pixels a side, with some specks."""
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, high, (-(-height // blocks), -(-width // blocks)))
    labels = np.kron(coarse, np.ones((blocks, blocks), np.int64))[:height, :width]
    specks = rng.random(labels.shape) < 0.01
    return np.where(specks, rng.integers(0, high, labels.shape), labels)


@given(sizes)
@settings(max_examples=80, deadline=None)
def test_labels_come_back(size: tuple[int, int, int, int]) -> None:
    for kind in (np.uint8, np.uint16):
        labels = areas(*size, high=int(np.iinfo(kind).max) + 1).astype(kind)
        data = encode_label_map(labels)
        back = decode_plain(data)
        assert back.dtype == kind
        np.testing.assert_array_equal(back, labels)
        assert data == encode_label_map(np.asfortranarray(labels))


@given(sizes)
@settings(max_examples=40, deadline=None)
def test_painted_labels_have_the_table_s_colours(size: tuple[int, int, int, int]) -> None:
    labels = areas(*size, high=34).astype(np.uint8)
    seen = cv2.imdecode(np.frombuffer(encode_painted(labels, COLOURS_RGBA), np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(cv2.cvtColor(seen, cv2.COLOR_BGRA2RGBA), colour_map(labels))


def test_a_file_is_what_other_readers_expect() -> None:
    """Pillow, which Cityscapes' scripts read with, checks every checksum."""
    labels = areas(200, 300, 25, 1, 34).astype(np.uint8)
    instances = (labels.astype(np.uint16) * 1000 + 7).astype(np.uint16)
    for data, mode, wanted in (
        (encode_label_map(labels), "L", labels),
        (encode_label_map(instances), "I;16", instances),
        (encode_painted(labels, COLOURS_RGBA), "RGBA", colour_map(labels)),
    ):
        with Image.open(io.BytesIO(data)) as picture:
            picture.verify()
        with Image.open(io.BytesIO(data)) as picture:
            assert picture.mode == mode
            np.testing.assert_array_equal(np.asarray(picture), wanted)


def test_files_stay_as_small_as_a_general_encoder_s() -> None:
    labels = areas(512, 1024, 40, 3, 34).astype(np.uint8)
    assert len(encode_label_map(labels)) < 1.3 * len(encode_labels(labels))
    instances = areas(512, 1024, 40, 3, 33000).astype(np.uint16)
    assert len(encode_label_map(instances)) < 1.3 * len(encode_labels(instances))
    assert len(encode_painted(labels, COLOURS_RGBA)) < 1.3 * len(encode_labels(colour_map(labels)))


def test_wrong_arrays_are_refused() -> None:
    with pytest.raises(ValueError, match="uint8 or uint16"):
        encode_label_map(np.zeros((4, 4), dtype=np.int32))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="shape"):
        encode_label_map(np.zeros((4, 4, 3), dtype=np.uint8))
