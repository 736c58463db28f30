from __future__ import annotations

import pytest

import gear
from gear.contracts.specs import KINDS
from gear.values.errors import UnknownNameError


def test_plugins_are_listed_with_their_packages() -> None:
    found = gear.list_plugins("task")
    assert {one.spec.name for one in found} >= {"semseg", "detect2d", "stereo3d", "depth"}
    assert found[0].owner.package == "mujoco-gear"
    assert all(one in gear.list_plugins() for one in found)
    assert {one.kind for one in gear.list_plugins()} == {kind for kind in KINDS if gear.list_plugins(kind)}


def test_an_unknown_kind_is_named() -> None:
    with pytest.raises(UnknownNameError, match=r"'taks'; did you mean task\?"):
        gear.list_plugins("taks")  # type: ignore[arg-type]
