"""Complete PNG and JPEG files pass; cut ones do not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from gear.formats.whole_picture import check_whole


def encoded(ending: str) -> bytes:
    """A picture of noise, so that every part of the file matters."""
    picture = np.random.default_rng(0).integers(0, 256, (32, 48, 3), np.uint8)
    return bytes(cv2.imencode(ending, picture)[1])


@pytest.mark.parametrize("ending", [".png", ".jpg"])
def test_only_whole_files_pass(ending: str) -> None:
    data = encoded(ending)
    check_whole(data)
    for share in (0.3, 0.6, 0.95):
        with pytest.raises(ValueError):
            check_whole(data[: int(share * len(data))])


def test_other_formats_are_left_to_their_decoder() -> None:
    check_whole(encoded(".bmp"))
    check_whole(b"")
