"""Lens distortion: one map for colour, depth and ids; Brown and Conrady's formula; the torch twin."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from gear.camera.effects.lens import Lens, LensDistortion, lens_map, undistorted
from gear.values.errors import FieldError
from gear.values.geometry import Intrinsics
from tests.camera.effects.scenes import CAMERA, FOCAL_PX, HEIGHT, WIDTH, exposure, raw

BARREL = Lens(k1=-0.12, k2=0.01)
OFF_CENTRE = Intrinsics(WIDTH, HEIGHT, FOCAL_PX, 90.0, (70.0, 52.0))


@pytest.mark.parametrize("lens", [BARREL, Lens(k1=0.1), Lens(k1=0.05, k2=-0.02)])
def test_a_lens_moves_colour_depth_and_ids_alike(lens: Lens) -> None:
    seen = LensDistortion(lens=lens).apply(raw(), exposure())
    assert seen.linear_rgb is not None
    column, row = seen.geom_id % 1000, seen.geom_id // 1000
    assert np.array_equal(seen.depth_m, (1 + seen.geom_id).astype(np.float32))
    assert np.abs(seen.linear_rgb[..., 0] / 4 - column).max() <= 0.76
    assert np.abs(seen.linear_rgb[..., 1] / 4 - row).max() <= 0.76
    assert (np.abs(column - np.arange(WIDTH)) > 1).mean() > 0.1, "it bends something"
    assert (np.diff(column, axis=1) >= 0).all() and (np.diff(row, axis=0) >= 0).all()


@pytest.mark.parametrize("pinhole", [CAMERA.intrinsics, OFF_CENTRE])
def test_the_map_is_brown_and_conradys_and_fills_the_picture(pinhole: Intrinsics) -> None:
    found = lens_map(BARREL, pinhole)
    centre = np.array([pinhole.cx_px, pinhole.cy_px])
    focal = np.array([pinhole.fx_px, pinhole.fy_px])
    offset = (np.stack([found.x, found.y], axis=-1) - centre) / focal
    square = (offset**2).sum(axis=-1, keepdims=True)
    zoom = found.focal_px / pinhole.fx_px
    bent = offset * (1 + BARREL.k1 * square + BARREL.k2 * square**2) * focal * zoom + centre
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    np.testing.assert_allclose(bent, np.stack([x, y], axis=-1), atol=0.01)
    assert found.focal_px > FOCAL_PX
    assert found.x.min() >= 0 and found.x.max() <= WIDTH - 1
    edges = (found.x.min(), found.y.min(), WIDTH - 1 - found.x.max(), HEIGHT - 1 - found.y.max())
    assert min(edges) < 0.5, "and shows as much as it can"


def test_a_pincushion_keeps_the_focal_length() -> None:
    assert lens_map(Lens(k1=0.1), CAMERA.intrinsics).focal_px == pytest.approx(FOCAL_PX)


@given(k1=st.floats(-0.15, 0.3), k2=st.floats(0, 0.05), x=st.floats(-0.9, 0.9), y=st.floats(-0.6, 0.6))
def test_undistorting_undoes_distortion(k1: float, k2: float, x: float, y: float) -> None:
    square = x * x + y * y
    bent = np.array([x, y]) * (1 + k1 * square + k2 * square**2)
    np.testing.assert_allclose(undistorted(Lens(k1=k1, k2=k2), bent), [x, y], atol=1e-7)


@pytest.mark.parametrize("pinhole", [CAMERA.intrinsics, OFF_CENTRE])
def test_the_map_forward_is_the_inverse_of_the_map_back(pinhole: Intrinsics) -> None:
    camera = dataclasses.replace(CAMERA, focal_y_px=pinhole.focal_y_px, principal_px=pinhole.principal_px)
    found = LensDistortion(lens=BARREL).pixel_map(camera)
    back = np.stack([found.x, found.y], axis=-1).astype(float)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    np.testing.assert_allclose(found.forward(back), np.stack([x, y], axis=-1), atol=0.01)


def test_the_torch_twin() -> None:
    colour = np.random.default_rng(3).integers(0, 1021, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    light = torch.from_numpy(colour.astype(np.float64)).permute(2, 0, 1)[None].requires_grad_()
    effect = LensDistortion(lens=BARREL)
    bent = effect.apply_torch(light, raw(), exposure())
    expected = effect.apply(raw(colour), exposure()).linear_rgb
    assert expected is not None
    # OpenCV knows 32 places between two pixels.
    assert np.abs(bent[0].permute(1, 2, 0).detach().numpy() - expected).max() < 1020 / 20
    assert np.abs(bent[0].permute(1, 2, 0).detach().numpy() - expected).mean() < 6
    bent.sum().backward()
    assert light.grad is not None and (light.grad >= 0).all() and light.grad.max() > 0


def test_the_record_holds_the_lens() -> None:
    recorded = LensDistortion(lens=BARREL).recorded(CAMERA)
    assert recorded.lens is not None and recorded.lens.focal_px > FOCAL_PX
    assert LensDistortion.from_record(recorded) == LensDistortion(lens=BARREL)
    assert LensDistortion.from_record(CAMERA) is None


def test_a_lens_that_folds_the_picture_over_is_refused() -> None:
    wide = dataclasses.replace(CAMERA, focal_px=20.0)
    LensDistortion(lens=BARREL).check(CAMERA)
    with pytest.raises(FieldError, match="folds") as caught:
        LensDistortion(lens=Lens(k1=-0.4, k2=-0.4)).check(wide)
    assert caught.value.field == "lens"
