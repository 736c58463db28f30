"""Finds the datasets in a folder, for errors about a folder that is no dataset itself."""

from __future__ import annotations

from pathlib import Path

from gear.values.counted import counted
from gear.values.errors import DatasetError

DEEPEST = 3
"""Largest number of folder levels between a folder and the dataset roots that are searched in it."""

LISTED = 5
"""Largest number of datasets that an error names."""


def roots_of(folder: Path) -> list[Path]:
    """Returns the folder itself if it is the root of a dataset, otherwise the sorted roots of datasets inside the
    folder.

    Args:
        folder: the folder; it is searched `DEEPEST` levels deep.
    """
    if next(folder.glob("gear/*/plan.json"), None) is not None:
        return [folder]
    plans = (plan for depth in range(DEEPEST + 1) for plan in folder.glob("*/" * depth + "gear/*/plan.json"))
    return sorted({plan.parents[2] for plan in plans})


def no_dataset(folder: Path) -> DatasetError:
    """The error about a folder that is not the root of a dataset; it names the datasets inside the folder.

    Args:
        folder: the folder; it may be missing.
    """
    roots = roots_of(folder) if folder.is_dir() else []
    if not roots:
        return DatasetError(folder, "is not a dataset of gear's (it has no gear/<split>/plan.json)")
    listed = ", ".join(str(root) for root in roots[:LISTED]) + ", …" * (len(roots) > LISTED)
    return DatasetError(folder, f"is a folder of {counted(len(roots), 'dataset')}; give one of them: {listed}")
