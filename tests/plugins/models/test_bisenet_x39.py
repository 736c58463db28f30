from __future__ import annotations

from gear.plugins.models.bisenet_x39 import bisenet_x39
from gear.testing.model_contract import ModelContract


class TestBiSeNetX39(ModelContract):
    spec = bisenet_x39
    options = {"weights": "none", "device": "cpu"}
