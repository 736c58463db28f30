"""What a layout of `gear export` is: a finished dataset in, the files of another tree out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from gear.contracts.tasks import Sidecar, SplitInfo
from gear.values.errors import FieldError
from gear.values.serial import Json

Read = Callable[[str], bytes]
"""The bytes of a file of the dataset, by path relative to its root; a file that was changed raises `DatasetError`."""

Tree = Iterator[tuple[str, bytes]]
"""Paths and bytes of the files of a new tree. No path comes twice; at most one file is in memory at a time."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ExportSplit:
    """One finished split.

    Attributes:
        info: names and seed of the split.
        task: name of its task.
        sidecars: of its samples, in order of index. Each is read when it is accessed.
        sidecar_paths: where the sidecars lie, relative to the dataset's root.
        manifest: versions, renderer and configuration of the split.
    """

    info: SplitInfo
    task: str
    sidecars: Sequence[Sidecar]
    sidecar_paths: Sequence[str] = ()
    manifest: Json = None


@dataclass(frozen=True, slots=True)
class NoOptions:
    """The options of a layout that has none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """A layout to export to.

    Attributes:
        tasks: names of the tasks whose datasets it takes; empty for any.
        summary: one line.
        tree: the files of the new tree, from splits, a function that reads the dataset's files, and the options.
        options: frozen dataclass of the options, all with defaults.
    """

    tasks: tuple[str, ...]
    summary: str
    tree: Callable[[Sequence[ExportSplit], Read, Any], Tree]
    options: type[Any] = NoOptions


def check_range(name: str, value: float, low: float, high: float) -> None:
    """Refuses an option of a layout out of its range.

    Raises:
        FieldError: names the option, its range and the value.
    """
    if not low <= value <= high:
        raise FieldError(name, f"must be {low:g} to {high:g}, got {value:g}")
