"""KITTI's flow pictures, read by the formula of the development kit."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from gear.formats.driving.flow_png import decode_flow, encode_flow
from gear.formats.png import encode_rgb


def devkit(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """`flow_read.m`: F_u = (I(:,:,1) - 2^15) / 64, F_v = (I(:,:,2) - 2^15) / 64, valid = I(:,:,3) > 0, in RGB order."""
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)[..., ::-1].astype(float)
    return (picture[..., :2] - 2**15) / 64, picture[..., 2] > 0


FLOW = np.array([[[0.0, 0.0], [3.25, -7.5], [-512.0, 511.984375]], [[512.0, 0.0], [np.nan, 1.0], [0.1, -0.1]]])


def test_the_development_kit_reads_it() -> None:
    flow_px, is_valid = devkit(encode_flow(FLOW.astype(np.float32)))
    assert is_valid.tolist() == [[True, True, True], [False, False, True]], "too large, and unknown"
    assert flow_px[0] == pytest.approx(FLOW[0])
    assert np.abs(flow_px[1, 2] - FLOW[1, 2]).max() <= 1 / 128


def test_gear_reads_what_it_writes() -> None:
    data = encode_flow(FLOW.astype(np.float32))
    flow_px, is_valid = devkit(data)
    read = decode_flow(data)
    assert np.array_equal(np.isfinite(read).all(axis=-1), is_valid)
    assert np.array_equal(read[is_valid], flow_px[is_valid])
    assert encode_flow(read) == data


def test_a_mask_leaves_pixels_out() -> None:
    mask = np.array([[True, False, True], [True, True, False]])
    _, is_valid = devkit(encode_flow(FLOW.astype(np.float32), mask))
    assert is_valid.tolist() == [[True, False, True], [False, False, False]]


def test_other_pictures_are_refused() -> None:
    for data in (b"", encode_rgb(np.zeros((4, 4, 3), np.uint8))):
        with pytest.raises(ValueError):
            decode_flow(data)
