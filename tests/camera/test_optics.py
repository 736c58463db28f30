"""The camera's effects: one map for every channel, grain that can be repeated, linear where it must be."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from gear.camera import torch_response
from gear.camera.optics import (
    lens_map,
    motion_blurred,
    noisy,
    through_lens,
    undistorted,
    vignette_map,
    vignetted,
)  # fmt: skip
from gear.contracts.rendering import RawView
from gear.values.errors import FieldError
from gear.values.frames import LINEAR_FULL_SCALE
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
from gear.values.optics import CameraEffects, Lens
from gear.values.rng import derive_rng
from gear.values.scene import CameraRecord, Pose

WIDTH, HEIGHT, FOCAL_PX = 160, 96, 80.0
CAMERA = CameraRecord(
    name="c", width_px=WIDTH, height_px=HEIGHT, focal_px=FOCAL_PX,
    world_from_camera=Pose.from_transform(
        RigidTransform.from_parts("world", "camera", CAMERA_FROM_ACTOR_AXES.T, (0, 0, 1.6))
    ),
)  # fmt: skip
BARREL = Lens(k1=-0.12, k2=0.01)


def raw() -> RawView:
    """Colour that says where it is: red counts columns, green rows; depth and ids say the same."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    colour = np.stack([x * 4, y * 4, np.full_like(x, 300)], axis=-1).astype(np.uint16)
    return RawView(
        linear_rgb=colour, depth_m=(1 + x + 1000.0 * y).astype(np.float32), geom_id=(x + 1000 * y).astype(np.int32)
    )


@pytest.mark.parametrize("lens", [BARREL, Lens(k1=0.1), Lens(k1=0.05, k2=-0.02)])
def test_a_lens_moves_colour_depth_and_ids_alike(lens: Lens) -> None:
    seen = through_lens(raw(), CAMERA, lens)
    assert seen.linear_rgb is not None
    column, row = seen.geom_id % 1000, seen.geom_id // 1000
    assert np.array_equal(seen.depth_m, (1 + seen.geom_id).astype(np.float32))
    assert np.abs(seen.linear_rgb[..., 0] / 4 - column).max() <= 0.76
    assert np.abs(seen.linear_rgb[..., 1] / 4 - row).max() <= 0.76
    assert (np.abs(column - np.arange(WIDTH)) > 1).mean() > 0.1, "it bends something"
    assert (np.diff(column, axis=1) >= 0).all() and (np.diff(row, axis=0) >= 0).all()


def test_the_map_is_brown_and_conradys_and_fills_the_picture() -> None:
    found = lens_map(BARREL, WIDTH, HEIGHT, FOCAL_PX)
    centre = np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2])
    pinhole = (np.stack([found.x, found.y], axis=-1) - centre) / FOCAL_PX
    square = (pinhole**2).sum(axis=-1, keepdims=True)
    bent = pinhole * (1 + BARREL.k1 * square + BARREL.k2 * square**2) * found.focal_px + centre
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    np.testing.assert_allclose(bent, np.stack([x, y], axis=-1), atol=0.01)
    assert found.focal_px > FOCAL_PX
    assert found.x.min() >= 0 and found.x.max() <= WIDTH - 1
    assert min(found.x.min(), found.y.min()) < 0.5, "and shows as much as it can"
    assert lens_map(Lens(k1=0.1), WIDTH, HEIGHT, FOCAL_PX).focal_px == pytest.approx(FOCAL_PX)


@given(k1=st.floats(-0.15, 0.3), k2=st.floats(0, 0.05), x=st.floats(-0.9, 0.9), y=st.floats(-0.6, 0.6))
def test_undistorting_undoes_distortion(k1: float, k2: float, x: float, y: float) -> None:
    square = x * x + y * y
    bent = np.array([x, y]) * (1 + k1 * square + k2 * square**2)
    np.testing.assert_allclose(undistorted(Lens(k1=k1, k2=k2), bent), [x, y], atol=1e-7)


def test_torch_twins_of_lens_and_vignette() -> None:
    colour = np.random.default_rng(3).integers(0, 1021, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    light = torch.from_numpy(colour.astype(np.float64)).permute(2, 0, 1)[None].requires_grad_()
    bent = torch_response.through_lens(light, lens_map(BARREL, WIDTH, HEIGHT, FOCAL_PX))
    expected = through_lens(dataclasses.replace(raw(), linear_rgb=colour), CAMERA, BARREL).linear_rgb
    # OpenCV knows 32 places between two pixels.
    assert np.abs(bent[0].permute(1, 2, 0).detach().numpy() - expected).max() < 1020 / 20
    assert np.abs(bent[0].permute(1, 2, 0).detach().numpy() - expected).mean() < 6
    dark = torch_response.vignetted(bent, torch.from_numpy(vignette_map(0.4, WIDTH, HEIGHT).copy()))
    dark.sum().backward()
    assert light.grad is not None and (light.grad >= 0).all() and light.grad.max() > 0
    flat = torch_response.vignetted(light.detach(), torch.from_numpy(vignette_map(0.4, WIDTH, HEIGHT).copy()))
    assert np.abs(flat[0].permute(1, 2, 0).numpy() - vignetted(colour, 0.4)).max() <= 0.51


def test_a_vignette_darkens_corners_by_what_it_says() -> None:
    share = vignette_map(0.4, WIDTH, HEIGHT)
    assert share[0, 0] == pytest.approx(0.6, abs=1e-3) == pytest.approx(share[-1, -1], abs=1e-3)
    assert share.max() == pytest.approx(1, abs=1e-3) and share[HEIGHT // 2, WIDTH // 2] > 0.999
    assert share[HEIGHT // 2, 0] < share[0, WIDTH // 2], "the sides lie farther out than top and bottom"


def test_noise_is_repeatable_unbiased_and_of_its_strength() -> None:
    flat = np.full((200, 200, 3), 510, np.uint16)
    first, again, other = (noisy(flat, 4.0, 1.0, derive_rng(5, "camera", i)) for i in (0, 0, 1))
    assert np.array_equal(first, again) and (first != other).mean() > 0.9
    assert first.mean() == pytest.approx(510, abs=0.5)
    expected = math.sqrt(0.5 * 0.04**2 + 0.01**2) * LINEAR_FULL_SCALE
    assert first.astype(float).std() == pytest.approx(expected, rel=0.03)
    dark = noisy(np.zeros_like(flat), 4.0, 1.0, derive_rng(5, "camera", 0))
    assert 0 < dark.astype(float).std() < 0.4 * first.astype(float).std()


def test_motion_blur_streams_from_the_middle_and_is_linear() -> None:
    depth = np.full((HEIGHT, WIDTH), 4.0, np.float32)
    depth[:20] = np.nan
    rng = np.random.default_rng(0)
    patch = rng.integers(0, 1021, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    half = (patch // 2).astype(np.uint16)
    blurred, dimmed = (motion_blurred(f, depth, CAMERA, (15.0, 0, 0), 0.03).astype(float) for f in (patch, half))
    assert np.abs(dimmed - blurred / 2).max() <= 1.5
    assert np.array_equal(blurred[:20], patch[:20]), "the sky stays"
    change = np.abs(blurred - patch).mean(axis=-1)
    assert change[40:56, 72:88].mean() < 0.6 * change[30:, :20].mean()
    assert np.array_equal(motion_blurred(patch, depth, CAMERA, (0.0, 0, 0), 0.03), patch)
    # A bright column is smeared evenly to both sides: the shutter's middle is the truth.
    line = np.zeros_like(patch)
    line[:, 30] = 900
    row = motion_blurred(line, depth, CAMERA, (0.0, 8.0, 0), 0.03)[60, :, 0].astype(float)
    assert (row * np.arange(WIDTH)).sum() / row.sum() == pytest.approx(30, abs=0.1)
    assert 3 <= (row > 0).sum() <= 8


@pytest.mark.parametrize(
    ("velocity_mps", "column", "way_px"),
    [((0.0, 8.0, 0.0), 30, 80 * 8 * 0.03 / 4), ((15.0, 0, 0), 130, 50.5 * 15 * 0.03 / 4), ((0.0, 0.0, 8.0), 30, 0.0)],
)
def test_a_column_is_smeared_over_the_way_that_it_goes(
    velocity_mps: tuple[float, float, float], column: int, way_px: float
) -> None:
    """Focal length times velocity over depth to the side; ahead, as far as it lies from the middle times closeness."""
    line = np.zeros((HEIGHT, WIDTH, 3), np.uint16)
    line[:, column] = 900
    depth = np.full((HEIGHT, WIDTH), 4.0, np.float32)
    row = motion_blurred(line, depth, CAMERA, velocity_mps, 0.03)[48, :, 0].astype(float)
    places = np.arange(WIDTH)
    middle = (row * places).sum() / row.sum()
    variance = (row * (places - middle) ** 2).sum() / row.sum()
    assert middle == pytest.approx(column, abs=0.4)
    # Of nine moments evenly over the way; reading between pixels adds a sixth of a pixel at most.
    assert variance == pytest.approx((np.linspace(-0.5, 0.5, 9) * way_px).var(), abs=0.3)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: CameraEffects(vignette=1.0), "vignette"),
        (lambda: CameraEffects(shot_noise=-1), "shot_noise"),
        (lambda: CameraEffects(shutter_s=2), "shutter_s"),
        (lambda: Lens(k1=0.9), "k1"),
    ],
)
def test_absurd_effects_are_refused(make: object, field: str) -> None:
    with pytest.raises(FieldError, match=field):
        make()  # type: ignore[operator]
