"""The lines over the pictures of a contact sheet."""

from __future__ import annotations

from gear.config.nodes import parse_text
from gear.plugins.build import build_task
from gear.testing.synthetic import synthetic_frame
from gear.verbs.sheet import caption


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
