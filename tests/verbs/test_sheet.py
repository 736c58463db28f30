"""The lines over the pictures of a contact sheet."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gear
from gear.config.nodes import parse_text
from gear.plugins import manager
from gear.plugins.build import build_task
from gear.plugins.catalogue import Catalogue, Owner
from gear.plugins.tasks.depth import DepthTask
from gear.testing.synthetic import synthetic_frame
from gear.values.errors import PluginError
from gear.verbs.sheet import caption, contact_sheet
from tests.verbs.conftest import Copy


def test_a_picture_of_a_pair_says_what_its_own_camera_sees() -> None:
    """Both said what both see: a scene with one board looked as if it had two."""
    _, task = build_task("stereo3d", parse_text('{"width_px": 320, "height_px": 96, "baseline_m": 3.0}', "options"))
    sample = task.ground_truth(*synthetic_frame(task.rig(), seed=5))
    of = {truth.camera: truth for truth in sample.surfaces}
    assert len(sample.surfaces) == 2 and of["left"].visible_fraction != of["right"].visible_fraction
    for camera, truth in of.items():
        said = caption(sample, camera)
        assert said == (f"synthetic 000000  {camera}  street  {truth.name} {truth.visible_fraction:.0%} at "
                        f"{truth.distance_m:.0f} m").replace("synthetic", sample.record.split)  # fmt: skip
    assert caption(sample, "labels").endswith(caption(sample, "left").partition("street")[2])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (3, "TypeError"),
        ({}, "ValueError: there is no picture"),
        ({"grey": np.zeros((4, 8), np.uint8)}, r"preview 'grey' is no \(H, W, 3\) uint8 picture but uint8 \(4, 8\)"),
        ({"unit": np.zeros((4, 8, 3))}, "preview 'unit' is no .* but float64"),
    ],
)
def test_a_third_partys_preview_that_is_no_picture_is_named(
    tmp_path: Path, copy_small: Copy, monkeypatch: pytest.MonkeyPatch, given: Any, message: str
) -> None:
    copy_small("depth", tmp_path, samples=1)
    owner = Owner(plugin="their-depth", package="mujoco-gear-2", version="1.2")
    found = tuple(dataclasses.replace(f, owner=owner) for f in manager.catalogue().of_kind("task"))
    monkeypatch.setattr("gear.plugins.build.catalogue", lambda: Catalogue(found))
    monkeypatch.setattr(DepthTask, "preview", lambda *_: given)
    with pytest.raises(PluginError, match=r"depth \(mujoco-gear-2 1\.2\) failed at preview of sample 0: .*" + message):
        contact_sheet(tmp_path)


def test_datasets_show_themselves_in_a_notebook(small: Callable[..., Path]) -> None:
    dataset = gear.open_dataset(small("semseg"))
    assert repr(dataset).startswith("Dataset(") and "task='semseg'" in repr(dataset) and len(repr(dataset)) < 300
    page = dataset._repr_html_()
    assert page.count("<tr>") == min(len(dataset), 4) and page.count("data:image/jpeg;base64,") >= len(dataset)
