from __future__ import annotations

from typing import ClassVar

from gear.plugins.models.stereo_centre import stereo_centre, stereo_centre_lite0
from gear.testing.model_contract import ModelContract


class TestStereoCentre(ModelContract):
    spec = stereo_centre
    options: ClassVar[dict[str, object]] = {"weights": "none", "device": "cpu", "width": 8}


class TestStereoCentreLite0(ModelContract):
    spec = stereo_centre_lite0
    options: ClassVar[dict[str, object]] = {"weights": "none", "device": "cpu", "width": 8}
