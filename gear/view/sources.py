"""The datasets that a page compares, twins of each other, with their evaluations."""

from __future__ import annotations

import dataclasses
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from gear.contracts.tasks import CONTROLS
from gear.dataset.reading import Dataset, pair_twins
from gear.plugins.datasets import open_dataset, root_and_split, roots_of
from gear.plugins.stored_evaluations import StoredResults, is_evaluation, open_evaluation
from gear.values.errors import DatasetError


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Source:
    """One dataset of a page.

    Attributes:
        dataset: the dataset split.
        label: label of the dataset on the page; empty if the page shows only one dataset.
        base_url: URL of the dataset's root relative to the page; ends in `/`.
        evaluated: the dataset's parts of the evaluations.
    """

    dataset: Dataset[Any]
    label: str
    base_url: str
    evaluated: tuple[StoredResults, ...] = ()


def sources_of(
    dataset: Dataset[Any], twins: Sequence[Dataset[Any]], evaluations: Iterable[str | Path], page: Path
) -> tuple[Source, ...]:
    """Combines a dataset with its twins and with the evaluations of any of them.

    Args:
        dataset: the dataset whose samples the page lists.
        twins: datasets that differ from it only in their patch.
        evaluations: folders of finished evaluations.
        page: path of the page, from which links are relative.

    Raises:
        DatasetError: a twin differs in more than the patch, or an evaluation contains none of the datasets.
    """
    for twin in twins:
        pair_twins(dataset, twin)
    every = [dataset, *twins]
    labels = unique([one.plan.info.patch_label for one in every], [one.root.name for one in every])
    folders = [Path(path) for path in evaluations]
    opened = [open_evaluation(folder) for folder in folders]
    names = unique([parts[0].label if parts else "" for parts in opened], [folder.name for folder in folders])
    for folder, parts in zip(folders, opened, strict=True):
        if not any(part.is_of(one) for part in parts for one in every):
            shown = ", ".join(str(one.root) for one in every)
            raise DatasetError(folder, f"is an evaluation of other datasets than {shown}; add theirs with --twin")
    return tuple(
        Source(
            dataset=one,
            label=label if twins else "",
            base_url=base_url(one.root, page),
            evaluated=tuple(
                dataclasses.replace(part, label=name)
                for parts, name in zip(opened, names, strict=True)
                for part in [part for part in parts if part.is_of(one)][:1]
            ),
        )
        for one, label in zip(every, labels, strict=True)
    )


def open_compared(
    path: str | Path, twins: Iterable[str | Path], split: str | None
) -> tuple[Dataset[Any], list[Dataset[Any]], list[Path]]:
    """Opens what a user asks to see: a dataset, a folder of twins, or an evaluation with its datasets.

    Args:
        path: root of a dataset; or a folder of datasets that are twins of each other, of which the one without a patch
            comes first; or the folder of an evaluation.
        twins: roots of further datasets.
        split: the split to show; optional if there is only one.

    Returns:
        The first dataset, its twins, and the evaluation's folder if `path` is one.

    Raises:
        DatasetError: there is no finished split to show, or the datasets in the folder are no twins.
    """
    further = [open_dataset(root, name or split) for root, name in map(root_and_split, twins)]
    if is_evaluation(path):
        first, *others = [_of_evaluation(part, Path(path)) for part in open_evaluation(path)]
        same = [one for one in others if one.plan.twin_key == first.plan.twin_key]
        return first, [*same, *further], [Path(path)]
    root, name = root_and_split(path)
    roots = roots_of(root) if root.is_dir() else []
    if len(roots) < 2 or root in roots:
        return open_dataset(root, name or split), further, []
    found = sorted((open_dataset(one, name or split) for one in roots), key=_order)
    if any(one.plan.twin_key != found[0].plan.twin_key for one in found):
        return open_dataset(root), further, []  # raises an error that lists the datasets
    return found[0], [*found[1:], *further], []


def _of_evaluation(part: StoredResults, folder: Path) -> Dataset[Any]:
    root = Path(str(part.metadata.get("root", "")))
    if not root.is_dir():
        raise DatasetError(folder, f"its dataset {root} is not here; give the dataset and --evaluation {folder}")
    return open_dataset(root, str(part.metadata.get("split")))


def _order(dataset: Dataset[Any]) -> tuple[int, str]:
    label = dataset.plan.info.patch_label
    return (CONTROLS.index(label) if label in CONTROLS else len(CONTROLS), label)


def unique(labels: Sequence[str], folders: Sequence[str]) -> list[str]:
    """Returns labels that all differ: a label that occurs several times is followed by its folder, and by a number if
    that does not suffice.
    """
    shared = Counter(labels)
    longer = [
        f"{label} ({folder})" if shared[label] > 1 else label for label, folder in zip(labels, folders, strict=True)
    ]
    counts = Counter(longer)
    return [
        f"{label} {longer[: place + 1].count(label)}" if counts[label] > 1 else label
        for place, label in enumerate(longer)
    ]


def base_url(root: Path, page: Path) -> str:
    """Returns the URL of a dataset's root relative to the page, ending in `/`."""
    return "./" + quote(Path(os.path.relpath(root.resolve(), page.resolve().parent)).as_posix()) + "/"
