"""Previews in notebooks are whole HTML fragments with escaped text."""

from __future__ import annotations

import base64
import re
from html.parser import HTMLParser

import cv2
import numpy as np

from gear.dataset.html_preview import WIDTH_PX, preview_table


class Tags(HTMLParser):
    """Counts opened and closed tags."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append(tag)
        if tag != "img":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_pictures_keep_their_colours_and_shape() -> None:
    red = np.zeros((40, 160, 3), np.uint8)
    red[..., 0] = 200
    page = preview_table("<data & more>", [("000000", {'left"': red}), ("000001", {"left": red})])
    tags = Tags()
    tags.feed(page)
    assert not tags.open and tags.seen.count("tr") == 2 and tags.seen.count("img") == 2
    assert "&lt;data &amp; more&gt;" in page and 'alt="left&quot;"' in page
    data = base64.b64decode(re.findall(r"base64,([^\"]+)", page)[0])
    shown = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert shown.shape == (WIDTH_PX // 4, WIDTH_PX, 3) and np.abs(shown.mean((0, 1)) - (0, 0, 200)).max() < 4
