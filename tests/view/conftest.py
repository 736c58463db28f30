"""Small datasets of every task, made without a renderer."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.contracts.tasks import SplitInfo, Task
from gear.dataset.plan import Plan
from gear.dataset.reading import Dataset
from gear.dataset.store import Store
from gear.plugins.build import find
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import board, street
from gear.values.geometry import RigidTransform
from gear.values.scene import SceneRecord
from gear.values.serial import to_json
from gear.verbs.opening import open_dataset

OPTIONS: dict[str, dict[str, Any]] = {
    "semseg": {"width_px": 384, "height_px": 192, "polygons": False},
    "detect2d": {"width_px": 400, "height_px": 240},
    "stereo3d": {"width_px": 408, "height_px": 124},
    "depth": {"width_px": 408, "height_px": 124},
}
Alter = Callable[[SceneRecord], SceneRecord]
Write = Callable[..., Path]


def store_samples(
    root: Path,
    name: str,
    task: Task[Any, Any],
    options: Any,
    count: int,
    *,
    split: str = "test",
    alter: Alter = lambda record: record,
) -> None:
    """Collects streets that differ in where the board stands: nearer from sample to sample."""
    info = SplitInfo(town="synthetic", scene="street", split=split, seed=5, patch_label="none")
    plan = Plan(task={"name": name, "package": "mujoco-gear"}, options=options, content={"weather": "ClearNoon"},
                patch={"label": "none"}, info=info, samples=count)  # fmt: skip
    store = Store(root, plan)
    store.open({})
    for index in store.missing():
        things = (*street(5, index)[1:], board(30.0 - 20.0 * index / max(count - 1, 1), 4.0))
        ego = RigidTransform.from_yaw("world", "ego", (12.0 + 3.0 * index, -34.0, 0.0), 0.4)
        frame, record = synthetic_frame(task.rig(), things, index=index, seed=5, world_from_ego=ego)
        sample = task.ground_truth(frame, alter(dataclasses.replace(record, split=split)))
        store.write(sample, task.encode(sample, info))
    store.close(task, {"renderer": {"name": "synthetic"}})


@pytest.fixture
def write_dataset(tmp_path: Path) -> Write:
    """`write_dataset("semseg", 3)` gives the root of a finished split."""

    def write(name: str, count: int = 3, **settings: Any) -> Path:
        spec = find("task", name).spec
        config = spec.config(**OPTIONS[name])
        root = tmp_path / name
        store_samples(root, name, spec.build(config), to_json(config), count, **settings)
        return root

    return write


@pytest.fixture
def opened(write_dataset: Write) -> Callable[..., Dataset[Any]]:
    """The same, opened."""
    return lambda name, count=3, **settings: open_dataset(write_dataset(name, count, **settings))


