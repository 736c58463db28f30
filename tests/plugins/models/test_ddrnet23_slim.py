from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.ddrnet23_slim import ddrnet23_slim
from gear.testing.model_contract import ModelContract


class TestDDRNet23Slim(ModelContract):
    spec = ddrnet23_slim
    options: ClassVar[dict[str, Any]] = {"weights": "none", "device": "cpu"}
