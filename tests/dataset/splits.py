"""Small splits, filled without a renderer."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from gear.config.nodes import parse_text
from gear.contracts.tasks import SplitInfo
from gear.dataset.plan import Plan
from gear.dataset.store import Store
from gear.plugins.build import build_task
from gear.testing.synthetic import synthetic_frame

OPTIONS = {"width_px": 160, "height_px": 80}


def plan(split: str = "test", samples: int = 3, **changes: Any) -> Plan:
    base = Plan(
        task={"name": "depth", "package": "mujoco-gear", "version": "0.1.0"},
        options=dict(OPTIONS),
        content={"scene": "billboard01", "seed": 5},
        patch={"label": "none", "sha256": ""},
        info=SplitInfo(town="town10", scene="billboard01", split=split, seed=5, patch_label="none"),
        samples=samples,
    )
    return dataclasses.replace(base, **changes)


def fill(root: Path, given: Plan, indices: list[int] | None = None, *, is_closed: bool = True, seed: int = 5) -> Store:
    _, task = build_task(given.task["name"], parse_text(json.dumps(given.options), "options"))
    store = Store(root, given)
    store.open({})
    for index in store.missing() if indices is None else indices:
        frame, record = synthetic_frame(task.rig(), index=index, seed=seed)
        record = dataclasses.replace(record, split=given.info.split)
        sample = task.ground_truth(frame, record)
        store.write(sample, task.encode(sample, given.info))
    if is_closed:
        store.close(task, {"seed": 5})
    return store


def tree(root: Path) -> dict[str, bytes]:
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in sorted(root.rglob("*")) if p.is_file()}
