"""Augmentation as a whole: repeatable, never in place, and for tasks that gear does not know."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from gear.augment.apply import Augmentation, Framing, augment, shrunk
from gear.augment.geometry import Geometry, flip_array
from gear.augment.pictures import Colours, recolour
from gear.augment.registry import geometry_of, register
from gear.plugins.build import build_task
from gear.plugins.tasks.depth import cut_depth
from gear.plugins.tasks.semseg import SemsegSample
from gear.testing.compare import difference
from gear.testing.synthetic import synthetic_frame
from gear.values.errors import FieldError, GearError
from gear.values.rng import derive_rng

EVERYTHING = Augmentation(
    flip=0.5, colour=1.0, colours=Colours(noise=1.0, blur=1.0, jpeg=1.0, erase=1.0), cut_depth=1.0
)
NOTHING = Augmentation(flip=0.0, colour=0.0)


def sample_of(name: str) -> Any:
    spec, _ = build_task(name)
    task = spec.build(spec.config(width_px=192, height_px=96))
    return task.ground_truth(*synthetic_frame(task.rig(), index=0, seed=3))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class OtherSample(SemsegSample):
    """A third party's, with a map that gear knows nothing of."""

    heat: Any


def other_sample() -> OtherSample:
    sample = sample_of("semseg")
    return OtherSample(
        **{name: getattr(sample, name) for name in ("record", "images", "surfaces", "label_ids", "instance_ids")},
        heat=sample.label_ids.astype(np.float32),
    )


@pytest.mark.parametrize("task", ["semseg", "depth", "detect2d", "stereo3d"])
def test_the_same_generator_makes_the_same_sample(task: str) -> None:
    framing = Framing(crop_px=(64, 96), scales=(0.7, 1.4))
    one, two, other = (augment(sample_of(task), EVERYTHING, framing, derive_rng(0, "a", k)) for k in (1, 1, 2))
    assert not difference(one, two, "sample")
    assert difference(one, other, "sample")
    assert all(picture.shape == (64, 96, 3) and picture.dtype == np.uint8 for picture in one.images.values())


@pytest.mark.parametrize("task", ["semseg", "depth", "detect2d", "stereo3d"])
def test_nothing_is_changed_in_place(task: str) -> None:
    sample = sample_of(task)
    for picture in sample.images.values():
        picture.setflags(write=False)
    augment(sample, EVERYTHING, Framing(), derive_rng(0, "a"))
    assert not difference(sample, sample_of(task), "sample")
    assert augment(sample, NOTHING, Framing(), derive_rng(0, "a")) is sample


def test_colours_leave_ground_truth_alone() -> None:
    sample = sample_of("semseg")
    result = augment(sample, replace(EVERYTHING, flip=0.0), Framing(), derive_rng(0, "a"))
    assert result.label_ids is sample.label_ids
    assert not np.array_equal(result.images["left"], sample.images["left"])


def test_depth_is_pasted_as_grey_into_a_band_of_at_most_three_quarters_of_the_columns() -> None:
    sample = sample_of("depth")
    picture, width = np.full_like(sample.images["left"], 255), sample.depth_m.shape[1]
    sample = replace(sample, images={"left": picture}, depth_m=np.minimum(sample.depth_m, 79.0))
    sample.depth_m[3] = np.nan
    wanted = np.rint(np.nan_to_num(sample.depth_m, nan=80.0) / 80 * 255)
    starts, widths = set(), set()
    for number in range(300):
        painted = cut_depth(sample, derive_rng(0, "band", number)).images["left"]
        changed = (painted != 255).any(axis=(0, 2))
        columns = np.flatnonzero(changed)
        band = slice(columns[0], columns[-1] + 1)
        assert changed[band].all() and (painted[:, band] == wanted[:, band, None]).all()
        assert len(columns) == 1 or len(columns) <= 0.75 * (width - columns[0])
        starts.add(int(columns[0]))
        widths.add(len(columns))
    assert min(starts) == 0 and max(starts) >= width - 5
    assert min(widths) == 1 and max(widths) > 0.6 * width


def test_both_views_of_a_pair_get_the_same_colours() -> None:
    sample = sample_of("stereo3d")
    twin = {"left": sample.images["left"], "right": sample.images["left"]}
    quiet = Colours(noise=0.0)
    changed = recolour(twin, quiet, derive_rng(0, "colours"))
    assert np.array_equal(changed["left"], changed["right"])
    assert not np.array_equal(changed["left"], sample.images["left"])


def test_colours_with_ranges_of_zero_return_the_same_picture() -> None:
    picture = sample_of("semseg").images["left"]
    still = Colours(brightness=0, contrast=0, saturation=0, balance=0, gamma=0, noise=0, blur=0, jpeg=0, erase=0)
    assert np.array_equal(recolour({"left": picture}, still, derive_rng(0, "c"))["left"], picture)


def test_a_strangers_samples_are_coloured_but_not_moved() -> None:
    sample = other_sample()
    assert geometry_of(sample) is None
    result = augment(sample, replace(EVERYTHING, flip=1.0), Framing(), derive_rng(0, "a"))
    assert result.label_ids is sample.label_ids and result.heat is sample.heat
    with pytest.raises(GearError, match="OtherSample cannot be cropped or resized"):
        augment(sample, NOTHING, Framing(crop_px=(64, 64)), derive_rng(0, "a"))


def test_a_stranger_may_say_how(monkeypatch: pytest.MonkeyPatch) -> None:
    from gear.augment import registry

    monkeypatch.setattr(registry, "_GEOMETRIES", dict(registry._GEOMETRIES))

    def flip(sample: OtherSample) -> OtherSample:
        return replace(sample, heat=flip_array(sample.heat))

    register(OtherSample, Geometry(flip=flip, cut=lambda sample, _: sample))
    sample = other_sample()
    result = augment(sample, replace(NOTHING, flip=1.0), Framing(), derive_rng(0, "a"))
    assert np.array_equal(result.heat, sample.heat[:, ::-1])
    with pytest.raises(ValueError, match="has a geometry already"):
        register(OtherSample, Geometry(flip=lambda s: s, cut=lambda s, _: s))


@pytest.mark.parametrize(("kind", "values"), [(Augmentation, {"flip": 1.5}), (Colours, {"brightness": 1.0}),
                                              (Colours, {"blur_px": 1e9}), (Colours, {"jpeg_quality": 0}),
                                              (Colours, {"gamma": -1.0})])  # fmt: skip
def test_what_makes_no_sense_is_refused(kind: Any, values: dict[str, float]) -> None:
    with pytest.raises(FieldError, match=next(iter(values))):
        kind(**values)


@pytest.mark.parametrize("task", ["semseg", "depth", "detect2d"])
def test_fewer_pixels_show_the_same_things_at_the_same_distance(task: str) -> None:
    sample = sample_of(task)
    assert shrunk(sample, 1) is sample
    small = shrunk(sample, 0.5)
    height, width = sample.images["left"].shape[:2]
    assert small.images["left"].shape == (height // 2, width // 2, 3)
    blocks = sample.images["left"].astype(float).reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))
    assert np.abs(small.images["left"] - blocks).max() <= 0.5
    if task == "detect2d":
        assert small.objects
        whole = {(thing.object_id, thing.label): thing.box_px for thing in sample.objects}
        for thing in small.objects:
            assert np.allclose(np.array(thing.box_px) * 2, whole[thing.object_id, thing.label], atol=4)
    else:
        name = "label_ids" if task == "semseg" else "depth_m"
        assert np.array_equal(getattr(small, name), getattr(sample, name)[1::2, 1::2], equal_nan=True)


def test_a_strangers_pictures_stay_as_large_as_they_are() -> None:
    with pytest.raises(GearError, match=r"OtherSample cannot be cropped or resized.*picture_scale=1"):
        shrunk(other_sample(), 0.5)
