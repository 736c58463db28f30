from __future__ import annotations

from typing import Any, ClassVar

import pytest

from gear.plugins.models.retinanet_r50_fpn import retinanet
from gear.testing.model_contract import ModelContract
from tests.networks.detector_samples import SMALL


@pytest.mark.slow
class TestRetinaNetR50(ModelContract):
    spec = retinanet
    options: ClassVar[dict[str, Any]] = {"weights": "none", "device": "cpu", "min_size_px": 64, "max_size_px": 128}
    task_options = SMALL
