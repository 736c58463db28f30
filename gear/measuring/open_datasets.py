"""Opens the datasets of an evaluation, which must have one task and differ from each other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

from gear.dataset.reading import Dataset
from gear.measuring.plugin_selection import Chosen, check_model
from gear.measuring.reports import reports_of
from gear.plugins.datasets import open_dataset, root_and_split, roots_of
from gear.values.errors import DatasetError, GearError


def opened(paths: Sequence[str | Path], split: str | None, model: Chosen, reports: Sequence[str]) -> list[Dataset[Any]]:
    """Opens the datasets of an evaluation.

    Args:
        paths: roots of datasets, folders of such roots, or `DIR:SPLIT`.
        split: split for paths that name none; None if each dataset has only one.
        model: model that must fit the datasets.
        reports: names of reports that must be available for the datasets.

    Returns:
        The datasets, in the order of `paths`; the datasets of a folder are sorted.

    Raises:
        GearError: there is no dataset, one is empty or of another task, or the model or a report does not fit it.
    """
    if not paths:
        raise GearError("there is nothing to evaluate on; give at least one dataset")
    places = [root_and_split(path) for path in paths]
    datasets = [open_dataset(root, own or split) for folder, own in places for root in roots_of(folder) or [folder]]
    first = datasets[0].plan
    for one in datasets:
        if one.plan.task["name"] != first.task["name"]:
            raise GearError(
                f"{one.root} is a {one.plan.task['name']} dataset, {datasets[0].root} a {first.task['name']} one"
            )
        if not len(one):
            raise DatasetError(one.root, "has no samples to evaluate on")
        check_model(model, one)
        reports_of(reports, one)
    return datasets


def row_names(datasets: Sequence[Dataset[Any]]) -> list[str]:
    """The folder names of datasets in an evaluation: split, patch and a hash of the content.

    Args:
        datasets: the datasets of the evaluation.

    Raises:
        GearError: a dataset was given twice.
    """
    names = [f"{one.plan.info.split}-{one.plan.info.patch_label}-{one.plan.content_key[:8]}" for one in datasets]
    for one, other in combinations(range(len(names)), 2):
        if names[one] == names[other]:
            raise GearError(f"{datasets[one].root} and {datasets[other].root} are the same data; give each once")
    return names
