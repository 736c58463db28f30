from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.adabins import spec
from gear.testing.model_contract import ModelContract


class TestAdabins(ModelContract):
    """The graph at a size that a test can afford; the published size is held to its keys in tests/networks."""

    spec = spec
    options: ClassVar[dict[str, Any]] = {
        "weights": "none",
        "device": "cpu",
        "encoder": "tf_efficientnet_b0",
        "features": 64,
        "queries": 7,
        "bins": 16,
    }
