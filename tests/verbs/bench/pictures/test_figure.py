"""A picture with its caption."""

from __future__ import annotations

import base64
import re

import cv2
import numpy as np

from gear.verbs.bench.pictures.figure import figure


def test_a_figure_holds_its_picture_at_the_given_width() -> None:
    picture = np.zeros((40, 80, 3), np.uint8)
    picture[..., 0] = 200  # red
    text = figure(picture, 'a "caption"', 20)
    assert 'width="20" height="10"' in text
    assert "a &quot;caption&quot;" in text
    found = re.search(r"base64,([^\"]+)", text)
    assert found is not None
    decoded = cv2.imdecode(np.frombuffer(base64.b64decode(found[1]), np.uint8), cv2.IMREAD_COLOR)
    assert decoded.shape == (10, 20, 3)
    np.testing.assert_allclose(decoded[..., ::-1].mean((0, 1)), [200, 0, 0], atol=4)
