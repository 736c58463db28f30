"""The rendered twin of a split."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gear.measuring.gap.twin import check_clean
from gear.values.errors import DatasetError


def test_only_a_split_without_a_patch_is_clean() -> None:
    def split(label: str) -> Any:
        return SimpleNamespace(root="d", plan=SimpleNamespace(patch={"label": label}))

    check_clean(split("none"))
    for label in ("random", "mine-1234"):
        with pytest.raises(DatasetError, match=f"d: shows the patch {label} itself; name a dataset collected with"):
            check_clean(split(label))
