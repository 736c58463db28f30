from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.bisenet_x39 import bisenet_x39
from gear.testing.model_contract import ModelContract


class TestBiSeNetX39(ModelContract):
    spec = bisenet_x39
    options: ClassVar[dict[str, Any]] = {"weights": "none", "device": "cpu"}
