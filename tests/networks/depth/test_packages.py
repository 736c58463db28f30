"""Optional packages of depth networks."""

from __future__ import annotations

import importlib.util

import pytest

from gear.networks import torchvision_import
from gear.networks.depth.packages import need_timm, need_transformers
from gear.values.errors import GearError


@pytest.mark.parametrize(("need", "package"), [(need_timm, "timm"), (need_transformers, "transformers")])
def test_a_missing_package_is_named_with_the_command_that_installs_it(
    need: object, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torchvision_import, "prepare", lambda: True)
    monkeypatch.setattr(torchvision_import, "need", lambda: None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == package else object())
    with pytest.raises(GearError, match=rf"this network needs {package}: pip install 'mujoco-gear\[models\]'"):
        need()  # type: ignore[operator]
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    need()  # type: ignore[operator]
