from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.fasterrcnn_lite0_fpn import fasterrcnn_lite0
from gear.testing.model_contract import ModelContract
from tests.networks.detector_samples import SMALL


class TestFasterRcnnLite0(ModelContract):
    spec = fasterrcnn_lite0
    options: ClassVar[dict[str, Any]] = {"weights": "none", "device": "cpu", "score_threshold": 0.01}
    task_options = SMALL
