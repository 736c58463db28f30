"""Incomplete JPEG files are found before libjpeg fills in what is missing with grey."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from gear.formats.jpeg_markers import check_markers
from gear.formats.quiet_decoder import decode_quietly

KINDS = {
    "baseline": [],
    "progressive": [cv2.IMWRITE_JPEG_PROGRESSIVE, 1],
    "restart markers": [cv2.IMWRITE_JPEG_RST_INTERVAL, 8],
}
NOISE = np.random.default_rng(0).integers(0, 256, (150, 300, 3), dtype=np.uint8)


def picture(kind: str) -> bytes:
    return bytes(cv2.imencode(".jpg", NOISE, KINDS[kind])[1])


@pytest.mark.parametrize("kind", KINDS)
def test_whole_files_pass(kind: str) -> None:
    whole = picture(kind)
    thumbnail = b"\xff\xe1" + (len(whole) // 8 + 2).to_bytes(2, "big") + whole[: len(whole) // 8]
    for data in (whole, whole + b"after the end", whole[:2] + thumbnail + whole[2:], whole[:2] + b"\xff" + whole[2:]):
        check_markers(data)
        assert decode_quietly(data) is not None
    check_markers(b"no jpeg")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("share", [0.001, 0.01, 0.2, 0.5, 0.9, 0.9999])
def test_a_cut_file_is_found_also_if_zeros_follow(kind: str, share: float) -> None:
    whole = picture(kind)
    kept = whole[: max(3, int(len(whole) * share))]
    for data in (kept, kept + bytes(len(whole) - len(kept))):
        with pytest.raises(ValueError, match="a JPEG file"):
            check_markers(data)


def test_an_end_without_a_picture_is_found() -> None:
    with pytest.raises(ValueError, match="damaged between its segments"):
        check_markers(b"\xff\xd8\xff\xd9")


@pytest.mark.parametrize("kind", KINDS)
def test_a_cut_scan_with_an_end_is_not_decoded(kind: str, capfd: pytest.CaptureFixture[str]) -> None:
    whole = picture(kind)
    for middle in (b"", bytes(len(whole) // 2)):
        assert decode_quietly(whole[: len(whole) // 2] + middle + b"\xff\xd9") is None
    assert capfd.readouterr().err == ""
