from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.glpn_b0 import spec
from gear.testing.model_contract import ModelContract


class TestGlpnB0(ModelContract):
    spec = spec
    options: ClassVar[dict[str, Any]] = {"weights": "none", "device": "cpu"}

    def test_its_size_is_the_one_it_states(self) -> None:
        module = self.make().module()  # type: ignore[attr-defined]
        assert sum(parameter.numel() for parameter in module.parameters()) == self.spec.parameters
