"""The camera's response and its torch twin."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from gear.camera import IDENTITY, Response, face_light, response_for, torch_response
from gear.values.frames import LINEAR_FULL_SCALE
from gear.world.weather.presets import PRESETS

RESPONSES = st.builds(
    Response,
    exposure=st.floats(0.05, 8),
    contrast=st.floats(0.5, 2),
    encoding=st.sampled_from(["srgb", "none"]),
)
EVERY_LEVEL = np.arange(LINEAR_FULL_SCALE + 1, dtype=np.uint16)


@given(RESPONSES)
def test_the_curve_rises_from_black_to_white(response: Response) -> None:
    values = response.curve(np.linspace(0, 1, 2000))
    assert values[0] == 0 and values[-1] == pytest.approx(1)
    assert (np.diff(values) > 0).all()


@given(RESPONSES, st.floats(0.001, 1))
def test_the_curve_can_be_undone(response: Response, light: float) -> None:
    assert float(response.inverse(response.curve(light))) == pytest.approx(light, rel=1e-6)


@given(RESPONSES)
def test_pictures_are_the_rounded_curve(response: Response) -> None:
    frame = np.stack([EVERY_LEVEL, EVERY_LEVEL[::-1], EVERY_LEVEL // 2], axis=-1)[None]
    picture = response.apply(frame)
    assert picture.dtype == np.uint8 and picture.shape == frame.shape
    assert np.abs(picture - 255 * response.curve(frame / LINEAR_FULL_SCALE)).max() <= 0.5 + 1e-9


def test_identity_gives_display_values_back() -> None:
    shown = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(3, axis=2)
    assert np.array_equal(IDENTITY.apply(shown.astype(np.uint16) * 4), shown)


@given(RESPONSES)
def test_torch_is_the_same_curve(response: Response) -> None:
    light = torch.linspace(0, 1, 3000, dtype=torch.float64)
    twin = torch_response.apply(response, light).numpy()
    np.testing.assert_allclose(twin, response.curve(light.numpy()), atol=0.01 / 255)


def test_torch_has_a_gradient_everywhere() -> None:
    light = torch.linspace(0, 1, 101, dtype=torch.float64, requires_grad=True)
    torch_response.apply(Response(2.0, 1.1), light).sum().backward()
    assert light.grad is not None and torch.isfinite(light.grad).all() and (light.grad[1:] > 0).all()
    inside = torch.rand(5, dtype=torch.float64, generator=torch.Generator().manual_seed(1)) * 0.9 + 0.05
    inside.requires_grad_(True)
    assert torch.autograd.gradcheck(lambda x: torch_response.apply(Response(1.7, 1.2), x), (inside,))


@pytest.mark.parametrize("response", [Response(1.7, 1.2), Response(0.4, 0.8), Response(encoding="none"), IDENTITY])
def test_gradients_are_the_curves_slopes_in_the_dark_and_in_the_light(response: Response) -> None:
    light = torch.tensor([1e-4, 8e-4, 0.004, 0.03, 0.5, 0.97], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda x: torch_response.apply(response, x), (light,), eps=1e-7)


def test_what_a_frame_would_clip_has_no_gradient() -> None:
    light = torch.tensor([-0.1, 0.0, 0.5, 1.0, 1.2], dtype=torch.float64, requires_grad=True)
    shown = torch_response.apply(Response(2.0), light)
    shown.sum().backward()
    assert light.grad is not None and (light.grad != 0).tolist() == [False, True, True, True, False]
    assert shown.tolist()[::4] == pytest.approx([0.0, 1.0])


def test_a_face_passes_gradients_of_its_own_slope() -> None:
    face = torch.tensor([0.01, 0.03, 0.05, 0.4, 0.99], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda x: torch_response.face_light("filament", x), (face,), eps=1e-7)
    assert torch.autograd.gradcheck(lambda x: torch_response.face_light("classic", x), (face,))


@pytest.mark.parametrize("name", ["filament", "classic"])
def test_the_weight_of_a_face_has_a_twin(name: str) -> None:
    face = np.arange(256, dtype=np.uint8)
    weights = face_light(name, face)
    assert weights[0] == 0 and weights[255] == 1 and (np.diff(weights) > 0).all()
    twin = torch_response.face_light(name, torch.from_numpy(face).double() / 255)
    np.testing.assert_allclose(twin.numpy(), weights, atol=1e-12)
    assert weights[128] == pytest.approx({"filament": 0.2159, "classic": 0.502}[name], abs=1e-3)


def test_every_weather_has_a_fixed_setting() -> None:
    settings = {name: response_for("filament", weather) for name, weather in PRESETS.items()}
    assert settings["ClearSunset"].exposure > settings["ClearNoon"].exposure > settings["CloudyNoon"].exposure
    for setting in settings.values():
        # A sunlit asphalt road (about a tenth of full scale) is mid-grey, a white wall is not blown out.
        assert 75 < 255 * setting.curve(0.1) < 140
        assert 225 < 255 * setting.curve(0.85) < 252
    assert all(response_for("classic", weather) == IDENTITY for weather in PRESETS.values())


def test_settings_out_of_range_are_refused() -> None:
    for wrong in ({"exposure": 0.0}, {"exposure": float("inf")}, {"exposure": float("nan")}, {"contrast": 3.0}):
        with pytest.raises(ValueError, match="must be"):
            Response(**wrong)
