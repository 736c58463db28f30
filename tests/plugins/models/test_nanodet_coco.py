from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.nanodet_coco import nanodet
from gear.testing.model_contract import ModelContract
from tests.networks.detector_samples import SMALL


class TestNanoDet(ModelContract):
    spec = nanodet
    options: ClassVar[dict[str, Any]] = {"weights": "none", "device": "cpu", "min_size_px": 64, "max_size_px": 128}
    task_options = SMALL
