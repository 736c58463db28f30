"""Motion blur: linear in light, of the right length, and the same in torch and in the compositor's samples."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from gear.camera.effects import PixelSamples
from gear.camera.effects.motion_blur import MotionBlur
from gear.values.frames import GeomTable, UInt16Image
from tests.camera.effects.scenes import CAMERA, HEIGHT, WIDTH, exposure, raw

BLUR = MotionBlur(shutter_s=0.03)
FLAT_M = np.full((HEIGHT, WIDTH), 4.0, np.float32)


def blurred(colour: UInt16Image, depth_m: np.ndarray, velocity_mps: tuple[float, float, float]) -> np.ndarray:
    shown = BLUR.apply(raw(colour, depth_m), exposure(velocity_mps)).linear_rgb
    assert shown is not None
    return shown


def test_motion_blur_streams_from_the_middle_and_is_linear() -> None:
    depth = FLAT_M.copy()
    depth[:20] = np.nan
    patch = np.random.default_rng(0).integers(0, 1021, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    half = (patch // 2).astype(np.uint16)
    shown, dimmed = (blurred(frame, depth, (15.0, 0, 0)).astype(float) for frame in (patch, half))
    assert np.abs(dimmed - shown / 2).max() <= 1.5
    assert np.array_equal(shown[:20], patch[:20]), "the sky stays"
    change = np.abs(shown - patch).mean(axis=-1)
    assert change[40:56, 72:88].mean() < 0.6 * change[30:, :20].mean()
    assert np.array_equal(blurred(patch, depth, (0.0, 0, 0)), patch)
    # A bright column is smeared evenly to both sides: the shutter's middle is the truth.
    line = np.zeros_like(patch)
    line[:, 30] = 900
    row = blurred(line, depth, (0.0, 8.0, 0))[60, :, 0].astype(float)
    assert (row * np.arange(WIDTH)).sum() / row.sum() == pytest.approx(30, abs=0.1)
    assert 3 <= (row > 0).sum() <= 8


@pytest.mark.parametrize(
    ("velocity_mps", "column", "way_px"),
    [((0.0, 8.0, 0.0), 30, 80 * 8 * 0.03 / 4), ((15.0, 0, 0), 130, 50.5 * 15 * 0.03 / 4), ((0.0, 0.0, 8.0), 30, 0.0)],
)
def test_a_column_is_smeared_over_its_path(
    velocity_mps: tuple[float, float, float], column: int, way_px: float
) -> None:
    """Focal length times velocity over depth to the side; ahead, as far as it lies from the middle times closeness."""
    line = np.zeros((HEIGHT, WIDTH, 3), np.uint16)
    line[:, column] = 900
    row = blurred(line, FLAT_M, velocity_mps)[48, :, 0].astype(float)
    places = np.arange(WIDTH)
    middle = (row * places).sum() / row.sum()
    variance = (row * (places - middle) ** 2).sum() / row.sum()
    assert middle == pytest.approx(column, abs=0.4)
    # Of nine moments evenly over the path; reading between pixels adds a sixth of a pixel at most.
    assert variance == pytest.approx((np.linspace(-0.5, 0.5, 9) * way_px).var(), abs=0.3)


def test_the_ego_cars_own_parts_stay_sharp() -> None:
    colour = np.random.default_rng(1).integers(0, 1021, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    view = dataclasses.replace(raw(colour, FLAT_M), geom_id=(np.mgrid[:HEIGHT, :WIDTH][0] > 70).astype(np.int32))
    table = GeomTable(
        label_code=np.zeros(2, np.uint8), object_id=np.array([-1, 1], np.int32), surface_index=np.full(2, -1, np.int16)
    )
    shown = BLUR.apply(view, dataclasses.replace(exposure((15.0, 0, 0)), geoms=table)).linear_rgb
    assert shown is not None
    assert np.array_equal(shown[71:], colour[71:]) and (shown[:60] != colour[:60]).mean() > 0.5


@pytest.mark.parametrize("principal_px", [None, (60.0, 55.0)])
def test_torch_twin_and_traced_samples_agree_with_the_picture(principal_px: tuple[float, float] | None) -> None:
    camera = dataclasses.replace(CAMERA, principal_px=principal_px, focal_y_px=100.0)
    smooth = (500 + 400 * np.sin(np.mgrid[:HEIGHT, :WIDTH].sum(axis=0) / 9)).astype(np.uint16)
    colour = np.repeat(smooth[..., None], 3, axis=2)
    here = exposure((12.0, 3.0, 0), camera=camera)
    shown = BLUR.apply(raw(colour, FLAT_M), here).linear_rgb
    assert shown is not None
    light = torch.from_numpy(colour.astype(np.float64)).permute(2, 0, 1)[None]
    twin = BLUR.apply_torch(light, raw(colour, FLAT_M), here)[0].permute(1, 2, 0).numpy()
    assert np.abs(twin - shown).max() < 4

    y, x = (axis[30:60, 40:120].reshape(-1, 1).astype(float) for axis in np.mgrid[:HEIGHT, :WIDTH])
    traced = BLUR.trace(
        PixelSamples(x=x, y=y, weight=np.ones_like(x), inverse_depth=lambda x, y: np.full_like(x, 0.25)), here
    )
    assert traced.x.shape == (x.size, 9) and traced.weight.sum(axis=1) == pytest.approx(1.0)
    nearest = colour[np.rint(traced.y).astype(int), np.rint(traced.x).astype(int), 0]
    mean = (nearest * traced.weight).sum(axis=1)
    assert np.abs(mean - shown[30:60, 40:120, 0].reshape(-1)).max() < 30
