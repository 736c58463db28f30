"""The paper's compositor against geometry: which place of a patch each pixel shows, and which pixels stay."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from gear.camera.effects import Exposure
from gear.compositor.homography import HomographyCompositor
from gear.compositor.sampling import SampleScheme, take_samples, unit_from_image
from gear.measuring.gap.picture_gap import visible_mask
from gear.plugins.build import build_task
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import CAR, Thing, board

from .conftest import MakeTwins

WIDTH, HEIGHT = 320, 160
FULL = (1.0, 0.0, 0.0)


def sample_of(*things: Thing) -> Any:
    spec, _ = build_task("semseg")
    task = spec.build(spec.config(width_px=WIDTH, height_px=HEIGHT))
    return task.ground_truth(*synthetic_frame(task.rig(), things))


def turned(thing: Thing, yaw_rad: float) -> Thing:
    return Thing(parts=thing.parts, position_m=thing.position_m, yaw_rad=yaw_rad)


def composed(sample: Any, *patches: Tensor) -> Tensor:
    """(H, W, 3)."""
    return HomographyCompositor([sample]).compose(patches, [0], "left")[0].permute(1, 2, 0)  # type: ignore[arg-type]


def stored(sample: Any) -> Tensor:
    return torch.from_numpy(sample.images["left"].copy()).float() / 255


def flat(red: float, green: float, blue: float) -> Tensor:
    return torch.tensor([red, green, blue]).view(3, 1, 1).expand(3, 4, 8).contiguous()


def places(sample: Any, number: int = 0) -> np.ndarray:
    """(2, H, W) where each pixel sees the surface, by the homography that the ground truth says."""
    homography = np.array(sample.surfaces[number].image_from_unit).reshape(3, 3)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    u, v, w = np.einsum("ij,jhw->ihw", np.linalg.inv(homography), np.stack([x, y, np.ones_like(x)]))
    return np.stack([u / w, v / w])


@pytest.mark.parametrize(("left_m", "yaw_rad"), [(0.0, 0.0), (4.0, 0.5), (-4.0, -0.9)])
def test_every_pixel_shows_the_place_of_the_patch_that_it_sees(left_m: float, yaw_rad: float) -> None:
    sample = sample_of(turned(board(14.0, left_m), yaw_rad))
    patch = torch.ones(3, 60, 120)
    patch[0], patch[1] = (torch.arange(120) + 0.5) / 120, ((torch.arange(60) + 0.5) / 60)[:, None]
    picture, (u, v) = composed(sample, patch).numpy(), places(sample)
    inside = (u > 0.04) & (u < 0.96) & (v > 0.04) & (v < 0.96)
    assert inside.sum() > 1500
    np.testing.assert_allclose(picture[inside], np.stack([u, v, np.ones_like(u)], axis=-1)[inside], atol=0.02)
    outside = (u < -0.03) | (u > 1.03) | (v < -0.03) | (v > 1.03)
    assert np.array_equal(picture[outside], stored(sample).numpy()[outside])


def test_edges_mix_the_patch_and_the_picture_by_what_each_covers() -> None:
    sample = sample_of(board(14.0, 1.0))
    share = (composed(sample, flat(*FULL)) - stored(sample))[..., 2] / -stored(sample)[..., 2].clamp_min(1e-6)
    (x0, y0), _, (x1, y1), _ = sample.surfaces[0].corners_px
    known = stored(sample)[..., 2] > 0.05
    assert bool(known.all()) and float(share.min()) == 0 and float(share.max()) == 1
    assert float(share.sum()) == pytest.approx((x1 - x0) * (y1 - y0), rel=0.01)


def test_objects_in_front_of_a_board_are_pasted_over() -> None:
    car = Thing(parts=CAR, position_m=(9.0, 0.0, 0.0), object_id=2, role="npc")
    sample = sample_of(board(18.0), car)
    u, v = places(sample)
    inside = torch.from_numpy((u > 0.03) & (u < 0.97) & (v > 0.03) & (v < 0.97))
    assert sample.surfaces[0].visible_px < 0.9 * int(inside.sum())
    assert torch.allclose(composed(sample, flat(*FULL))[inside], torch.tensor(FULL), atol=1e-5)


@pytest.mark.parametrize("near", [0, 1])
def test_the_nearer_of_two_boards_is_on_top(near: int) -> None:
    distances_m = (12.0, 24.0) if near == 0 else (24.0, 12.0)
    sample = sample_of(board(distances_m[0], 0.5), board(distances_m[1], -0.5, surface=1))
    colours = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    picture = composed(sample, *(flat(*colour) for colour in colours))
    u, v = places(sample, near)
    inside = torch.from_numpy((u > 0.03) & (u < 0.97) & (v > 0.03) & (v < 0.97))
    assert torch.allclose(picture[inside], torch.tensor(colours[near]), atol=1e-5)


def test_a_board_that_is_seen_from_behind_shows_no_patch() -> None:
    sample = sample_of(turned(board(14.0), np.pi))
    assert torch.equal(composed(sample, flat(*FULL)), stored(sample))


@pytest.mark.parametrize("distance_m", [14.0, 26.5])
def test_a_mip_level_is_the_logarithm_of_a_samples_longer_edge_in_texels(distance_m: float) -> None:
    """1200 texels over 7.4 m, 600 over 3.7 m; a pixel is (distance - 1.5 m) / 160 wide."""
    sample = sample_of(board(distance_m))
    record, (truth,) = sample.record, sample.surfaces
    camera = record.camera("left")
    scan = SampleScheme(supersampled=False, extrapolates=False, smooths=False)
    unit = unit_from_image(truth, record.surfaces[0], camera)
    middle = np.array([159.5]), np.array([79.5])
    found = take_samples(scan, unit, middle, np.ones((HEIGHT, WIDTH), np.bool_), Exposure(camera=camera, scene=record))
    texels = (distance_m - 1.5) / camera.focal_px * 1200 / 7.4
    assert found.level[0, 0] == pytest.approx(np.log2(texels), abs=1e-6)


def test_a_lens_bends_what_is_pasted_as_it_bends_the_board(twins: MakeTwins) -> None:
    _, twin = twins(settings=("camera.lens.k1=-0.3",))
    sample = twin[0]
    seen = visible_mask(sample.surfaces, "left", *sample.images["left"].shape[:2])
    compositor = HomographyCompositor(twin)
    patches = [[flat(*colour)] * compositor.surfaces for colour in (FULL, (0.0, 0.0, 1.0))]
    red, blue = (compositor.compose(several, [0], "left")[0] for several in patches)
    pasted = ((red - blue)[0] > 0.5).numpy()
    assert (pasted & seen).sum() > 0.93 * (pasted | seen).sum()
    truth = np.array(sample.surfaces[0].image_from_unit).reshape(3, 3)
    y, x = np.mgrid[: seen.shape[0], : seen.shape[1]]
    u, v, w = np.einsum("ij,jhw->ihw", np.linalg.inv(truth), np.stack([x, y, np.ones_like(x)]))
    unbent = (w > 0) & (abs(u / w - 0.5) <= 0.5) & (abs(v / w - 0.5) <= 0.5)
    assert (unbent & seen).sum() < 0.8 * (unbent | seen).sum()


def test_the_memory_of_a_prepared_sample_is_that_of_its_tensors() -> None:
    compositor = HomographyCompositor([sample_of(board(14.0))])  # type: ignore[arg-type]
    prepared = compositor._load(0, "left", ((4, 8),))
    inner = prepared.inner
    tensors = [prepared.picture, prepared.where, inner.background, *inner.covers]
    parts = [tensor.numel() * tensor.element_size() for tensor in tensors]
    assert prepared.nbytes == sum(parts) + inner.matrices[0].nbytes
    assert all(parts)


def test_edges_read_the_near_side_of_the_patch() -> None:
    """Samples beside the board do not count: they would read the opposite side of the repeating texture."""
    sample = sample_of(turned(board(14.0, -4.0), -0.9))
    patch = torch.zeros(3, 60, 120)
    patch[0, :, :60], patch[2, :, 60:] = 1, 1
    cover = 1 - composed(sample, flat(0.0, 1.0, 0.0))[..., 0] / stored(sample)[..., 0]
    blue = (composed(sample, patch) - stored(sample) * (1 - cover[..., None]))[..., 2] / cover
    left_edge = torch.from_numpy(places(sample)[0] < 0.1) & (cover > 0.2) & (cover < 0.9)
    assert int(left_edge.sum()) > 10
    assert float(blue[left_edge].max()) < 0.5


def test_pixels_are_the_covered_share_of_the_patch_and_the_rest_of_the_picture() -> None:
    """With a black patch c = s (1 - a), with a white one c = a + s (1 - a), for a pixel s and its covered share a."""
    sample = sample_of(turned(board(14.0, -4.0), -0.9))
    black, white = (composed(sample, flat(value, value, value)) for value in (0.0, 1.0))
    share = white - black
    assert torch.allclose(black, stored(sample) * (1 - share), atol=1e-6)
    assert set((share * 4).round(decimals=4).unique().tolist()) == {0.0, 1.0, 2.0, 3.0, 4.0}


def test_a_board_seen_from_behind_hides_no_other_board() -> None:
    front, back = board(24.0, -0.5), turned(board(12.0, 0.5, surface=1), np.pi)
    sample = sample_of(front, back)
    picture = composed(sample, flat(0.0, 0.0, 1.0), flat(*FULL))
    u, v = places(sample, 0)
    inside = torch.from_numpy((u > 0.03) & (u < 0.97) & (v > 0.03) & (v < 0.97))
    assert torch.allclose(picture[inside], torch.tensor((0.0, 0.0, 1.0)), atol=1e-5)
