from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.adabins_lite0 import spec
from gear.testing.model_contract import ModelContract


class TestAdabinsLite0(ModelContract):
    spec = spec
    options: ClassVar[dict[str, Any]] = {"weights": "none", "device": "cpu"}
