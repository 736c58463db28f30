"""Which paths a sample's files can have."""

from __future__ import annotations

import pytest

from gear.dataset.layout import auxiliary_path, is_reserved


@pytest.mark.parametrize(
    "path",
    [
        "leftImg8bit/val/a.png",
        "val/README.md",
        auxiliary_path("val", "probes", 3, "x.png"),
        "gear/val/scans/000000_v.bin",
    ],
)
def test_files_of_samples_and_their_auxiliary_files_are_not_reserved(path: str) -> None:
    assert not is_reserved(path, "val")


@pytest.mark.parametrize(
    "path",
    ["gear/val/plan.json", "gear/test/probes/000000_x.png", "gear/val/claims/000000.claim", "gear", "Gear/x/plan.json",
     "README.md", "./readme.MD", "croissant.json", "gear//val/manifest.json", "gear/val/probes"],
)  # fmt: skip
def test_gears_own_files_and_those_of_other_splits_are_reserved(path: str) -> None:
    assert is_reserved(path, "val")
