import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.formats.png import decode_plain, decode_rgb, encode_labels, encode_rgb, encode_tiff
from gear.formats.png_rows import whole

sizes = st.tuples(st.integers(1, 40), st.integers(1, 40), st.integers(0, 2**32 - 1))


@given(sizes)
@settings(max_examples=60, deadline=None)
def test_colour_comes_back(size: tuple[int, int, int]) -> None:
    height, width, seed = size
    rgb = np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)
    data = encode_rgb(rgb)
    np.testing.assert_array_equal(decode_rgb(data), rgb)
    assert data == encode_rgb(rgb.copy())


@given(sizes)
@settings(max_examples=60, deadline=None)
def test_labels_come_back(size: tuple[int, int, int]) -> None:
    height, width, seed = size
    rng = np.random.default_rng(seed)
    for kind in (np.uint8, np.uint16):
        labels = rng.integers(0, np.iinfo(kind).max + 1, (height, width)).astype(kind)
        back = decode_plain(encode_labels(labels))
        assert back.dtype == kind
        np.testing.assert_array_equal(back, labels)


def test_red_is_red_for_everybody_else() -> None:
    red = np.zeros((4, 6, 3), dtype=np.uint8)
    red[..., 0] = 255
    seen = cv2.imdecode(np.frombuffer(encode_rgb(red), np.uint8), cv2.IMREAD_UNCHANGED)
    assert seen.shape == (4, 6, 3)
    assert (seen[..., 2] == 255).all() and (seen[..., 0] == 0).all()
    rgba = np.concatenate([red, np.full((4, 6, 1), 255, np.uint8)], axis=2)
    seen = cv2.imdecode(np.frombuffer(encode_labels(rgba), np.uint8), cv2.IMREAD_UNCHANGED)
    assert seen.shape == (4, 6, 4)
    assert (seen[..., 2] == 255).all() and (seen[..., 3] == 255).all()


def test_floats_come_back_bit_by_bit() -> None:
    values = np.random.default_rng(1).gamma(2.0, 30.0, (37, 41)).astype(np.float32)
    back = decode_plain(encode_tiff(values))
    assert back.dtype == np.float32
    np.testing.assert_array_equal(back, values)


def test_pictures_need_not_be_contiguous() -> None:
    rgb = np.random.default_rng(2).integers(0, 256, (30, 60, 3), dtype=np.uint8)[::-1, ::2]
    np.testing.assert_array_equal(decode_rgb(encode_rgb(rgb)), rgb)


@pytest.mark.parametrize(
    "data", [b"", b"not a picture", b"\x89PNG\r\n\x1a\n", whole(60_000, 60_000, 8, 2, zlib.compress(b"\0"))]
)
def test_rubbish_is_refused(data: bytes) -> None:
    for decode in (decode_rgb, decode_plain):
        with pytest.raises(ValueError, match=r"not a picture|is 60000 x 60000 px"):
            decode(data)


def test_wrong_arrays_are_refused() -> None:
    with pytest.raises(ValueError, match="must have shape"):
        encode_rgb(np.zeros((4, 4), dtype=np.uint8))
    with pytest.raises(ValueError, match="uint8 or uint16"):
        encode_labels(np.zeros((4, 4), dtype=np.int32))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="float32"):
        encode_tiff(np.zeros((4, 4)))  # type: ignore[arg-type]
