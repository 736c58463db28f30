"""Small splits from synthetic frames, and the trees that layouts make of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Sidecar, SplitInfo
from gear.dataset.layout import sidecar_path
from gear.formats.exports.layout import ExportSplit
from gear.formats.exports.registry import find_layout
from gear.plugins.build import NO_OPTIONS
from gear.testing.task_contract import INFO, TaskContract
from gear.values.scene import SceneRecord
from tests.dataset.splits import fill, plan

SMALL = {"semseg": (320, 160), "detect2d": (320, 192), "stereo3d": (306, 92), "depth": (160, 80)}


def dataset(root: Path, task: str, splits: Sequence[str] = ("val",), **options: Any) -> Path:
    """A finished dataset of two samples per split."""
    width, height = SMALL[task]
    for split in splits:
        base = plan(split, 2)
        fill(
            root,
            replace(
                base,
                task=base.task | {"name": task},
                options={"width_px": width, "height_px": height} | options,
            ),
        )
    return root


def written(
    root: Path, spec_: TaskSpec[Any], options_: Mapping[str, Any], indices: tuple[int, ...] = (0, 1)
) -> ExportSplit:
    """A split whose files lie below `root`."""

    class Writer(TaskContract):
        spec = spec_
        options = options_

    sidecars = tuple(Writer().write(root, indices))
    paths = [sidecar_path(INFO.split, index) for index in indices]
    return ExportSplit(info=INFO, task=spec_.name, sidecars=sidecars, sidecar_paths=paths)


def with_records(split: ExportSplit, *records: SceneRecord) -> ExportSplit:
    """The split with other records for its samples."""
    pairs = zip(split.sidecars, records, strict=False)
    return replace(split, sidecars=tuple(replace(sidecar, record=record) for sidecar, record in pairs))


def exported(layout: str, splits: Sequence[ExportSplit], root: Path, *settings: str) -> dict[str, bytes]:
    """The tree of a layout, by path."""
    chosen = find_layout(layout)
    options = read_node(chosen.options, with_overrides(NO_OPTIONS, settings), "options")
    files: dict[str, bytes] = {}
    for path, data in chosen.tree(splits, lambda relative: (root / relative).read_bytes(), options):
        assert path not in files, "no file is written twice"
        files[path] = data
    return files


def split_of(info: SplitInfo, task: str, *records: SceneRecord) -> ExportSplit:
    """A split of these records, without files."""
    sidecars = tuple(Sidecar(record=record, surfaces=(), facts={}, files={}) for record in records)
    return ExportSplit(info=info, task=task, sidecars=sidecars)
