"""Opens the finished splits that the paths of a command refer to, for training."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from gear.dataset.reading import Dataset
from gear.dataset.store import splits_of
from gear.plugins.datasets import open_dataset, root_and_split, roots_of
from gear.values.errors import DatasetError, GearError

KEPT_FOR_TESTS = "test"


def open_all(
    paths: Iterable[str | Path], task: str, *, names: Sequence[str], allow_test_data: bool = False
) -> tuple[Dataset[Any], ...]:
    """Opens every split that the paths refer to.

    Args:
        paths: roots of datasets, folders of such roots, or roots with a split as `DIR:SPLIT`.
        task: name of the task that all splits must have.
        names: splits to open from a root that holds several.
        allow_test_data: whether `test` splits are accepted as training data.

    Raises:
        DatasetError: a path holds no dataset, or a split is of another task or not finished.
        GearError: a split is a test split, or two splits hold the same samples.
    """
    found = [dataset for path in paths for dataset in _open(path, names)]
    known: dict[Any, Dataset[Any]] = {}
    for dataset in found:
        same = known.setdefault((dataset.plan.twin_key, *sorted(dataset.plan.patch.items())), dataset)
        if same is not dataset:
            raise GearError(f"{same.root} and {dataset.root} hold the same samples; give them once")
        split = dataset.plan.info.split
        if dataset.plan.task["name"] != task:
            raise DatasetError(dataset.root, f"holds a {dataset.plan.task['name']} dataset, not {task}")
        if split.split("_")[0] == KEPT_FOR_TESTS and not allow_test_data:
            raise GearError(
                f"{dataset.root}: split {split!r} is what networks are tested on, so it is not learnt from; collect a "
                "split such as finetuning, or say --allow-test-data if nothing will be reported on it"
            )
    return tuple(found)


def _open(path: str | Path, names: Sequence[str]) -> list[Dataset[Any]]:
    root, split = root_and_split(path)
    if not root.is_dir():
        raise DatasetError(root, "there is no such folder")
    roots = roots_of(root)
    if not roots:
        raise DatasetError(root, "holds no dataset of gear's (there is no gear/<split>/plan.json below it)")
    return [open_dataset(place, name) for place in roots for name in ([split] if split else _wanted(place, names))]


def _wanted(root: Path, names: Sequence[str]) -> list[str]:
    there = splits_of(root)
    chosen = [name for name in there if name.split("_")[0] in names]
    if len(there) == 1 or not chosen:
        if len(there) > 1:
            raise DatasetError(root, f"holds several splits ({', '.join(there)}); say which as DIR:SPLIT")
        return list(there)
    return chosen
