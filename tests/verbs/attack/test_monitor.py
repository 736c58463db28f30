"""The monitor of an attack keeps the best patches, stops an attack that no longer improves, and writes checkpoints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from safetensors.numpy import save as to_bytes

from gear.contracts.attacks import Patch
from gear.verbs.attack.folder import read_patches
from gear.verbs.attack.monitor import Recorder


def test_patience_ends_it(tmp_path: Path) -> None:
    harms = iter([1.0, 3.0, 2.0, 2.5, 2.9])
    patches = [(Patch(name="patch_0", rgb=np.full((2, 2, 3), n, np.float32)),) for n in range(5)]
    recorder = Recorder(root=tmp_path, key="k", steps=9, judge=lambda _: next(harms), every=1, patience=2)
    asked = [recorder.step(n + 1, {"a": n}, lambda n=n: patches[n], dict) for n in range(4)]  # type: ignore[misc]
    assert asked == [False, False, False, True] and "validation" in recorder.stopped
    assert recorder.best is patches[1]


def test_what_cannot_be_measured_is_never_the_best(tmp_path: Path) -> None:
    harms = iter([float("nan"), 1.0, 2.0, float("nan"), 3.0])
    patches = [(Patch(name="patch_0", rgb=np.full((2, 2, 3), n, np.float32)),) for n in range(5)]
    recorder = Recorder(root=tmp_path, key="k", steps=9, judge=lambda _: next(harms), every=1, patience=2)
    for n in range(5):
        assert not recorder.step(n + 1, {"a": n}, lambda n=n: patches[n], dict)  # type: ignore[misc]
    assert recorder.best is patches[4]


def test_many_patches_stay_in_the_order_of_their_surfaces(tmp_path: Path) -> None:
    patches = tuple(Patch(name=f"patch_{n}", rgb=np.full((2, 2, 3), n, np.float32)) for n in range(12))
    recorder = Recorder(root=tmp_path, key="k", steps=9, best=patches)
    recorder.save(1, {"done": np.int64(1)})
    resumed = Recorder(root=tmp_path, key="k", steps=9)
    resumed.resume()
    assert [patch.name for patch in resumed.best or ()] == [patch.name for patch in patches]
    (tmp_path / "patch.safetensors").write_bytes(to_bytes({patch.name: patch.rgb for patch in patches}))
    assert [patch.name for patch in read_patches(tmp_path)] == [patch.name for patch in patches]
