"""Paths of gear's own files in a dataset: all lie below `gear/`, in one folder per split."""

from __future__ import annotations

GEAR = "gear"


def split_folder(split: str) -> str:
    """The folder of one split's sidecars, plan and manifest."""
    return f"{GEAR}/{split}"


def sidecar_path(split: str, index: int) -> str:
    """Path of the sidecar of one sample; it is written last, so that a sample with a sidecar is complete."""
    return f"{split_folder(split)}/samples/{index:06d}.json"


def auxiliary_path(split: str, kind: str, index: int, name: str) -> str:
    """The path of an auxiliary file of a sample; `kind` is the name of its folder, such as `probes`."""
    return f"{split_folder(split)}/{kind}/{index:06d}_{name}"


def plan_path(split: str) -> str:
    """Path of the plan of a split, which holds everything that decides its bytes; written first."""
    return f"{split_folder(split)}/plan.json"


def begun_path(split: str, what: str) -> str:
    """Path of a note with the files of a sample, or of the indexes, that are being written; deleted when they are
    complete.
    """
    return f"{split_folder(split)}/begun/{what}.json"


def claim_path(split: str, index: int) -> str:
    """The claim on a sample by the run that is making it; removed when the sample is there."""
    return f"{split_folder(split)}/claims/{index:06d}.claim"


def failed_path(split: str, index: int) -> str:
    """A note on a sample that could not be made; removed when the sample is there."""
    return f"{split_folder(split)}/failed/{index:06d}.json"


def manifest_path(split: str) -> str:
    """Path of the manifest, which lists all files of a finished split; written last."""
    return f"{split_folder(split)}/manifest.json"


def patch_path(label: str, name: str) -> str:
    """Path of the copy of a patch that a split shows."""
    return f"{GEAR}/patches/{label}/{name}"
