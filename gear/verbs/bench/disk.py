"""Estimates the disk space of a benchmark's pictures from its first collections."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gear.dataset.disk_and_time_forecast import LARGE_BYTES
from gear.dataset.files import inside
from gear.dataset.free_space import check_free_space, free_bytes, size_text, tree_bytes
from gear.dataset.layout import manifest_path
from gear.values.counted import counted
from gear.values.progress import Warn
from gear.verbs.bench.plan import Step

Kind = tuple[str, bool]
"""A task, and whether its samples have probes: samples of a kind have about the same size."""


class PictureSpace:
    """Measures the first collection of each kind, and checks that the pictures of all others fit on the disk."""

    def __init__(self, steps: Sequence[Step], root: Path, on_warning: Warn) -> None:
        """Finds the collections that are not finished.

        Args:
            steps: all steps of the benchmark.
            root: its folder.
            on_warning: called once with the disk space of a large benchmark.
        """
        self._root, self._on_warning, self._is_announced = root, on_warning, False
        self._left = {id(step): step for step in steps if step.verb == "collect" and not _is_finished(step)}
        self._sample_bytes: dict[Kind, float] = {}

    def step_done(self, step: Step) -> None:
        """Takes notice of a finished step; the first collection of a kind is measured.

        Args:
            step: the step.

        Raises:
            GearError: the pictures of the collections that are left do not fit on the disk.
        """
        if self._left.pop(id(step), None) is None or _kind(step) in self._sample_bytes:
            return
        size = tree_bytes(Path(step.arguments["out"]))
        self._sample_bytes[_kind(step)] = size / max(1, step.arguments["samples"])
        typical = sum(self._sample_bytes.values()) / len(self._sample_bytes)
        samples = sum(one.arguments["samples"] for one in self._left.values())
        needed = sum(
            one.arguments["samples"] * self._sample_bytes.get(_kind(one), typical) for one in self._left.values()
        )
        what = f"the {counted(samples, 'missing sample')} of this benchmark need"
        advice = "give --out on another disk, or lower the numbers of samples, scenes or weathers"
        check_free_space(self._root, needed, what=what, advice=advice)
        if needed > LARGE_BYTES and not self._is_announced:
            self._is_announced = True
            self._on_warning(
                f"{what} about {size_text(needed)} of the {size_text(free_bytes(self._root))} that are free"
            )


def _kind(step: Step) -> Kind:
    return step.arguments["task"], bool(step.arguments.get("probes"))


def _is_finished(step: Step) -> bool:
    """Whether the split of a collection exists and is finished."""
    return inside(Path(step.arguments["out"]), manifest_path(step.arguments["split"])).exists()
