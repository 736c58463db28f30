from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.glpdepth import spec
from gear.testing.model_contract import ModelContract


class TestGlpdepth(ModelContract):
    """The graph at a size that a test can afford; the published size is held to its keys in tests/networks."""

    spec = spec
    options: ClassVar[dict[str, Any]] = {
        "weights": "none",
        "device": "cpu",
        "blocks": (1, 1, 1, 1),
        "widths": (8, 16, 40, 64),
        "decoder_width": 8,
    }
