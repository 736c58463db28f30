from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.ddrnet23_slim_depth import spec
from gear.testing.model_contract import ModelContract


class TestDdrnet23SlimDepth(ModelContract):
    spec = spec
    options: ClassVar[dict[str, Any]] = {"weights": "none", "device": "cpu"}
