"""Damaged PNG files are found before libpng complains of them on stderr."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from gear.formats.png import decode_rgb
from gear.formats.png_chunks import check_chunks


def picture() -> bytes:
    noise = np.random.default_rng(0).integers(0, 255, (32, 32, 3), dtype=np.uint8)
    return bytes(cv2.imencode(".png", noise)[1])


def test_whole_files_and_other_formats_pass() -> None:
    check_chunks(picture())
    check_chunks(picture() + b"after the end")
    check_chunks(b"no png")


@pytest.mark.parametrize("at", [20, 45, 400, -6])
def test_a_changed_byte_is_found_and_nothing_is_printed(at: int, capfd: pytest.CaptureFixture[str]) -> None:
    data = bytearray(picture())
    data[at] ^= 0x55
    with pytest.raises(ValueError, match="PNG file"):
        check_chunks(bytes(data))
    with pytest.raises(ValueError, match=r"PNG file|px; sides of"):
        decode_rgb(bytes(data))
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("length", [9, 30, 300, -1])
def test_a_cut_file_is_found(length: int) -> None:
    with pytest.raises(ValueError, match="PNG file"):
        check_chunks(picture()[:length])
