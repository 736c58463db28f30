"""Arrows of lanes on a map."""

from __future__ import annotations

import numpy as np
import pytest

from gear.verbs.towns import traffic_layer
from gear.verbs.towns.canvas import Canvas


@pytest.mark.parametrize("heading_deg", [0, 90, 180, 270])
def test_arrows_point_the_way(heading_deg: int) -> None:
    canvas = Canvas((60, 60), (255, 255, 255))
    traffic_layer.lane_arrow(canvas, np.array([30.0, 30.0]), np.radians(heading_deg), 40.0, (0, 0, 0))
    ink = 255 - canvas.picture()[..., 0].astype(float)
    turned = np.rot90(ink, -heading_deg // 90)  # now it should point to the right
    widths = (turned > 100).sum(axis=0)
    assert 0 < widths[45] < widths[30] < widths[21]
