"""Plain PNG files come out as OpenCV reads them; everything else is left to it."""

from __future__ import annotations

import zlib

import cv2
import fpng
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.formats.png import decode_plain, decode_rgb, encode_labels, encode_rgb
from gear.formats.png_rows import decode_rows, encode_deep, whole

FILTERS = {"none": cv2.IMWRITE_PNG_FILTER_NONE, "sub": cv2.IMWRITE_PNG_FILTER_SUB, "up": cv2.IMWRITE_PNG_FILTER_UP}


def picture(seed: int, height: int, width: int, channels: int, dtype: str) -> np.ndarray:
    """Areas and noise, so that filters and codes of all kinds occur."""
    rng = np.random.default_rng(seed)
    shape = (height, width, channels) if channels > 1 else (height, width)
    found = rng.integers(0, np.iinfo(dtype).max + 1, shape).astype(dtype)
    found[: height // 2] = found[0, 0]
    return found


def encoded(image: np.ndarray, kind: str) -> bytes:
    stored = image[..., ::-1] if image.ndim == 3 else image
    done, data = cv2.imencode(".png", np.ascontiguousarray(stored), [cv2.IMWRITE_PNG_FILTER, FILTERS[kind]])
    assert done
    return bytes(data)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 99), st.integers(1, 40), st.integers(1, 40), st.sampled_from(list(FILTERS)),
    st.sampled_from([(1, "uint8"), (1, "uint16"), (3, "uint8")]),
)  # fmt: skip
def test_what_goes_in_comes_out(seed: int, height: int, width: int, kind: str, sort: tuple[int, str]) -> None:
    image = picture(seed, height, width, *sort)
    found = decode_rows(encoded(image, kind))
    if found is None:  # OpenCV may choose another filter for a row
        found = (decode_rgb if sort[0] == 3 else decode_plain)(encoded(image, kind))
    assert found.dtype == image.dtype and np.array_equal(found, image)
    assert found.flags.c_contiguous and found.flags.writeable


@pytest.mark.parametrize("seed", range(4))
def test_gears_own_files_are_read_the_quick_way(seed: int) -> None:
    colour = picture(seed, 37, 53, 3, "uint8")
    assert np.array_equal(decode_rows(encode_rgb(colour)), colour)
    assert np.array_equal(decode_rows(bytes(fpng.from_ndarray(np.zeros((9, 7, 3), np.uint8)))), np.zeros((9, 7, 3)))
    for dtype in ("uint8", "uint16"):
        labels = picture(seed, 37, 53, 1, dtype)
        assert np.array_equal(decode_rows(encode_labels(labels)), labels)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 99), st.integers(1, 40), st.integers(1, 40))
def test_deep_maps_are_files_that_everybody_reads(seed: int, height: int, width: int) -> None:
    values = picture(seed, height, width, 1, "uint16")
    data = encode_deep(values)
    assert np.array_equal(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED), values)
    assert np.array_equal(decode_rows(data), values)


def test_other_pictures_are_left_alone() -> None:
    image = picture(1, 20, 30, 3, "uint8")
    paeth = bytes(cv2.imencode(".png", image, [cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_PAETH])[1])
    alpha = bytes(cv2.imencode(".png", picture(1, 20, 30, 4, "uint8"))[1])
    deep = bytes(cv2.imencode(".png", picture(1, 20, 30, 3, "uint16"))[1])
    jpeg = bytes(cv2.imencode(".jpg", image)[1])
    for data in (paeth, alpha, deep, jpeg, b"", b"no picture"):
        assert decode_rows(data) is None
    assert np.array_equal(decode_rgb(paeth), image[..., ::-1])


@pytest.mark.parametrize("place", [4, 12, 20, 28, 40, 60, 200, -20, -6])
def test_a_broken_file_is_never_taken_for_a_whole_one(place: int) -> None:
    data = bytearray(encode_rgb(picture(2, 24, 24, 3, "uint8")))
    assert decode_rows(bytes(data[:place])) is None
    data[place] ^= 0x10
    assert decode_rows(bytes(data)) is None


def test_a_header_that_promises_more_than_there_is_costs_nothing() -> None:
    """Nothing of the promised size is set aside."""
    for channels in (1, 3):  # the latter's size is more than a processor counts to
        data = encoded(picture(3, 8, 8, channels, "uint8"), "none")
        header = b"IHDR" + (2**31 - 1).to_bytes(4, "big") * 2 + data[24:29]
        data = data[:12] + header + zlib.crc32(header).to_bytes(4, "big") + data[33:]
        assert decode_rows(data) is None


@pytest.mark.parametrize(("height", "width"), [(0, 5), (5, 0)])
def test_a_picture_without_pixels_is_left_alone(height: int, width: int) -> None:
    """A row of no pixels is still a byte, its filter, so that the data are as long as they should be."""
    data = zlib.compress(bytes(height))
    assert decode_rows(whole(width, height, 8, 0, data)) is None
