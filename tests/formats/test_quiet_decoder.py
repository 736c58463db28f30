"""Damaged pictures of any format are decoded, or refused, without a word of the decoders."""

from __future__ import annotations

import os

import cv2
import numpy as np
import pytest

from gear.formats.quiet_decoder import decode_quietly

PICTURE = np.random.default_rng(0).integers(0, 255, (64, 64, 3), dtype=np.uint8)


@pytest.mark.parametrize("kind", ["png", "jpg", "tiff", "webp", "bmp"])
def test_decoders_write_nothing(kind: str, capfd: pytest.CaptureFixture[str]) -> None:
    data = cv2.imencode(f".{kind}", PICTURE)[1].tobytes()
    assert np.shape(decode_quietly(data)) == (64, 64, 3)
    half = len(data) // 2
    damaged = data[:half] + bytes(byte ^ 0x5A for byte in data[half : half + 40]) + data[half + 40 :]
    for broken in (damaged, data[:half], data[:20], b"nothing of a picture", b""):
        decode_quietly(broken)
    os.write(2, b"after")
    assert capfd.readouterr().err == "after", "stderr is as before"
