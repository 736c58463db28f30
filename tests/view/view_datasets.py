"""Small datasets of every task, made without a renderer."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gear.contracts.tasks import SplitInfo, Task
from gear.dataset.plan import Plan
from gear.dataset.store import Store
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import board, street
from gear.values.frames import UInt8Image
from gear.values.geometry import RigidTransform
from gear.values.scene import SceneRecord

OPTIONS: dict[str, dict[str, Any]] = {
    "semseg": {"width_px": 384, "height_px": 192, "polygons": False},
    "detect2d": {"width_px": 400, "height_px": 240},
    "stereo3d": {"width_px": 408, "height_px": 124},
    "depth": {"width_px": 408, "height_px": 124},
}
Alter = Callable[[SceneRecord], SceneRecord]


def patched(picture: UInt8Image, size: int) -> UInt8Image:
    """A copy of a picture with an inverted square of `size` pixels in its middle."""
    changed = picture.copy()
    top, left = (picture.shape[0] - size) // 2, (picture.shape[1] - size) // 2
    changed[top : top + size, left : left + size] = 255 - changed[top : top + size, left : left + size]
    return changed


def store_samples(
    root: Path,
    name: str,
    task: Task[Any, Any],
    options: Any,
    count: int,
    *,
    split: str = "test",
    alter: Alter = lambda record: record,
    patch: str = "none",
) -> None:
    """Collects streets that differ in where the board stands: nearer from sample to sample.

    With a patch, a block in the middle of every picture is inverted; it is the larger, the nearer the board.
    """
    info = SplitInfo(town="synthetic", scene="street", split=split, seed=5, patch_label=patch)
    plan = Plan(task={"name": name, "package": "mujoco-gear"}, options=options, content={"weather": "ClearNoon"},
                patch={"label": patch}, info=info, samples=count)  # fmt: skip
    store = Store(root, plan)
    store.open({})
    for index in store.missing():
        things = (*street(5, index)[1:], board(30.0 - 20.0 * index / max(count - 1, 1), 4.0))
        ego = RigidTransform.from_yaw("world", "ego", (12.0 + 3.0 * index, -34.0, 0.0), 0.4)
        frame, record = synthetic_frame(task.rig(), things, index=index, seed=5, world_from_ego=ego)
        sample = task.ground_truth(frame, alter(dataclasses.replace(record, split=split)))
        if patch != "none":
            shown = {name: patched(picture, 10 * (index + 1)) for name, picture in sample.images.items()}
            sample = dataclasses.replace(sample, images=shown)
        store.write(sample, task.encode(sample, info))
    store.close(task, {"renderer": {"name": "synthetic"}})
