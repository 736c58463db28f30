"""The interface of a layout of `gear export`: a function from a finished dataset to the files of another directory
tree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from gear.contracts.tasks import Sidecar, SplitInfo
from gear.values.errors import FieldError
from gear.values.serial import Json

Read = Callable[[str], bytes]
"""Function that returns the bytes of a dataset's file, by path relative to the dataset's root. It raises `DatasetError`
if the file was changed after it was written.
"""

Tree = Iterator[tuple[str, bytes]]
"""Pairs of path and bytes, the files of a new directory tree. No path occurs twice; at most one file is in memory at a
time.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ExportSplit:
    """One finished split of a dataset that is exported.

    Attributes:
        info: names and seed of the split.
        task: name of its task.
        sidecars: the sidecar of each sample (its JSON file), in order of index; each file is read when its entry is
            accessed.
        sidecar_paths: paths of the sidecars, relative to the dataset's root.
        manifest: versions, renderer and configuration of the split.
    """

    info: SplitInfo
    task: str
    sidecars: Sequence[Sidecar]
    sidecar_paths: Sequence[str] = ()
    manifest: Json = None


@dataclass(frozen=True, slots=True)
class NoOptions:
    """The empty options of a layout that has no options."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """A layout to which `gear export` can write a dataset.

    Attributes:
        tasks: names of the tasks whose datasets the layout accepts; empty for all tasks.
        summary: a one-line description.
        tree: function that yields the files of the new tree. Its arguments are the splits, a function that reads the
            dataset's files, and the options.
        options: frozen dataclass of the layout's options, all with defaults.
    """

    tasks: tuple[str, ...]
    summary: str
    tree: Callable[[Sequence[ExportSplit], Read, Any], Tree]
    options: type[Any] = NoOptions


def check_range(name: str, value: float, low: float, high: float) -> None:
    """Checks that the value of a layout's option lies in its range `low` to `high`.

    Args:
        name: name of the option.
        value: its value.
        low, high: smallest and largest allowed value.

    Raises:
        FieldError: the value is out of range; the message names the option, its range and the value.
    """
    if not low <= value <= high:
        raise FieldError(name, f"must be {low:g} to {high:g}, got {value:g}")
