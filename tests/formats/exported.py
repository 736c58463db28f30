"""A split on disk, and what a layout makes of it."""

from pathlib import Path
from typing import Any

from gear.formats.exports import SplitRecords, layouts
from gear.testing.task_contract import INFO, TaskContract


def collected(root: Path, spec_: Any, options_: dict[str, Any], indexes: tuple[int, ...] = (0, 1)) -> SplitRecords:
    class Writer(TaskContract):
        spec = spec_
        options = options_

    return SplitRecords(info=INFO, records=tuple(sidecar.record for sidecar in Writer().write(root, indexes)))


def export(name: str, splits: list[SplitRecords], root: Path) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    for path, data in layouts()[name].tree(splits, lambda relative: (root / relative).read_bytes()):
        assert path not in files, "no file is written twice"
        files[path] = data
    return files
