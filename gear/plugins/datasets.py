"""Opens datasets with the plugin of the task that wrote them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gear.config.nodes import parse_text
from gear.contracts.tasks import Sample, Task
from gear.dataset.find_datasets import roots_of
from gear.dataset.plan import Plan
from gear.dataset.reading import Dataset, Twins, pair_twins, read_manifest
from gear.dataset.store import plan_of, splits_of
from gear.plugins.build import build_task, name_of_task
from gear.values.errors import DatasetError

__all__ = ["Dataset", "Twins", "open_dataset", "open_twins", "root_and_split", "roots_of", "task_of"]


def open_dataset(path: str | Path, split: str | None = None) -> Dataset[Any]:
    """Opens one finished split of a dataset.

    Args:
        path: root folder of the dataset.
        split: name of the split; optional if there is only one.

    Returns:
        A sequence of samples, decoded one by one: `dataset[0].images["left"]`, `.record`, `.surfaces` and the task's
        own fields.

    Raises:
        DatasetError: there is no dataset, no such split, or it is not finished.
        UnknownNameError: the plugin of the dataset's task is not installed.
    """
    root = Path(path)
    if split is None:
        names = splits_of(root)
        if len(names) > 1:
            raise DatasetError(root, f"holds several splits ({', '.join(names)}); say which")
        split = names[0]
    plan = plan_of(root, split)
    manifest = read_manifest(root, plan)
    return Dataset(root=root, plan=plan, task=task_of(root, plan), manifest=manifest)


def task_of(root: Path, plan: Plan) -> Task[Any, Any]:
    """Builds the task that wrote a split, with the options that are stored in the split's plan.

    Args:
        root: root folder of the dataset, for messages.
        plan: the stored configuration of the split.

    Raises:
        UnknownNameError: the task's plugin is not installed.
        ConfigError: the plugin does not accept the options in the plan.
    """
    _, task = build_task(name_of_task(plan.task), parse_text(_as_yaml(plan.options), f"{root} options"))
    return task


def root_and_split(path: str | Path) -> tuple[Path, str | None]:
    """Splits a path written as `DIR` or `DIR:SPLIT` into the dataset's root and the split's name (None for `DIR`).

    Args:
        path: the path; a path that exists is not split, even with a colon.
    """
    if not Path(path).exists() and ":" in str(path):
        text, _, split = str(path).rpartition(":")
        return Path(text), split
    return Path(path), None


def open_twins(first: str | Path, second: str | Path, split: str | None = None) -> Twins[Sample]:
    """Opens two datasets that differ only in their patch (twins), and pairs their samples by index.

    Args:
        first, second: root folders of the two datasets.
        split: name of the split; None if each dataset has only one.

    Raises:
        DatasetError: the datasets differ in more than the patch, or one of them cannot be opened.
    """
    return pair_twins(open_dataset(first, split), open_dataset(second, split))


def _as_yaml(options: Any) -> str:
    import yaml

    return str(yaml.safe_dump(options, sort_keys=False))
