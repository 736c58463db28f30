"""Where gear keeps its own files inside a dataset: everything under `gear/`, one folder a split."""

from __future__ import annotations

GEAR = "gear"


def split_folder(split: str) -> str:
    """Folder of one split's sidecars and manifest."""
    return f"{GEAR}/{split}"


def sidecar_path(split: str, index: int) -> str:
    """The sidecar of one sample; it is written last, so a sample that has one is whole."""
    return f"{split_folder(split)}/samples/{index:06d}.json"


def auxiliary_path(split: str, kind: str, index: int, name: str) -> str:
    """A file that a sample owns beside its task's: `kind` is its folder."""
    return f"{split_folder(split)}/{kind}/{index:06d}_{name}"


def plan_path(split: str) -> str:
    """What the split was begun with; written first."""
    return f"{split_folder(split)}/plan.json"


def begun_path(split: str, what: str) -> str:
    """Names files that are being written, a sample's or the index files, until what makes them whole is there."""
    return f"{split_folder(split)}/begun/{what}.json"


def manifest_path(split: str) -> str:
    """What the finished split holds; written last."""
    return f"{split_folder(split)}/manifest.json"


def patch_path(label: str, name: str) -> str:
    """A copy of the patch that was used."""
    return f"{GEAR}/patches/{label}/{name}"
