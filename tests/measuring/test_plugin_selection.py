"""Models that assume a camera are refused for pictures of another one."""

from __future__ import annotations

from typing import Any

import pytest

from gear.measuring.plugin_selection import check_optics, chosen_model
from gear.values.errors import GearError


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"principal_px": [600.0, 180.0]}, "collected with principal_px, but model 'stereo_rcnn' assumes a pinhole"),
        ({"focal_px": 700.0, "focal_y_px": 690.0}, "collected with focal_px and focal_y_px, but model 'stereo_rcnn'"),
        ({"hfov_deg": 60.0}, "with hfov_deg 60"),
    ],
)
def test_a_stereo_network_refuses_pictures_of_another_pinhole(options: dict[str, Any], said: str) -> None:
    with pytest.raises(GearError, match=said):
        check_optics(chosen_model("stereo_rcnn", []), options, "collected")


def test_networks_without_a_camera_take_pictures_of_any() -> None:
    check_optics(chosen_model("ddrnet23_slim", []), {"principal_px": [600.0, 180.0]}, "collected")
    usual = {"hfov_deg": 90.0, "principal_px": None, "focal_px": None}
    check_optics(chosen_model("stereo_rcnn", []), usual, "collected")
