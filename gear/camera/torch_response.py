"""The camera's response (exposure and tone curve) in torch, for gradients.

It is separate from `gear.camera.response`, so that collecting datasets does not import torch.
"""

from __future__ import annotations

from typing import Any

import torch
from torch.autograd.function import once_differentiable

from gear.camera.response import Response


def apply(response: Response, light: torch.Tensor) -> torch.Tensor:
    """Applies exposure and tone curve to a tensor, like `Response.curve`; differentiable once.

    Args:
        response: exposure and tone curve.
        light: (...) float linear light; it is clamped to 0..1, as frames are clipped at full scale.

    Returns:
        (...) picture values 0..1 with the dtype of `light`, not rounded to bytes.
    """
    with torch.no_grad():
        x = light.clamp(0.0, 1.0)
        share = 1 / (1 + (response.exposure - 1) * x)
        values, slope = x * response.exposure * share, response.exposure * share.square()
        if response.contrast != 1:
            # A power has no finite gradient at 0.
            safe = values.clamp_min(1e-12)
            bent = safe**response.contrast
            slope *= torch.where(values < 1e-12, 0.0, response.contrast * bent / safe)
            values = bent
        if response.encoding == "srgb":
            values, last = _encoded(values)
            slope *= last
        slope *= x == light
    return _curve(light, values, slope)


def face_light(renderer_name: str, face: torch.Tensor) -> torch.Tensor:
    """Converts a face's picture values 0..1 to the weights w by which frames are composed, in a tensor of the same
    shape.

    A frame that shows the face is B + w (W - B), where B and W are the frames with a black and a white face. w is the
    picture value for the classic renderer, and the albedo decoded from sRGB for all other renderers.

    Args:
        renderer_name: name of the renderer that made the frames.
        face: sRGB values of the face (a patch) in 0..1, any shape.
    """
    return face if renderer_name == "classic" else decode_srgb(face)


def decode_srgb(values: torch.Tensor) -> torch.Tensor:
    """Converts sRGB values to linear light 0..1, elementwise; differentiable once.

    Args:
        values: sRGB values in 0..1, any shape.
    """
    with torch.no_grad():
        base = (values.clamp_min(0.04045) + 0.055) / 1.055
        bent = base**2.4
        is_dark = values <= 0.04045
        light = torch.where(is_dark, values / 12.92, bent)
        slope = torch.where(is_dark, 1 / 12.92, bent / base * (2.4 / 1.055))
    return _curve(values, light, slope)


def _encoded(light: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """sRGB values 0..1 of linear light 0..1, and the derivatives of sRGB with respect to light."""
    base = light.clamp_min(0.0031308)
    power = base ** (1 / 2.4)
    is_dark = light <= 0.0031308
    values = torch.where(is_dark, light * 12.92, 1.055 * power - 0.055)
    return values, torch.where(is_dark, 12.92, power / base * (1.055 / 2.4))


def _curve(given: torch.Tensor, values: torch.Tensor, slope: torch.Tensor) -> torch.Tensor:
    curve: torch.Tensor = _Curve.apply(given, values, slope)  # type: ignore[no-untyped-call]
    return curve


class _Curve(torch.autograd.Function):
    """An elementwise function with known derivatives, so that its backward pass is one product."""

    @staticmethod
    def forward(ctx: Any, light: torch.Tensor, values: torch.Tensor, slope: torch.Tensor) -> torch.Tensor:
        ctx.save_for_backward(slope)
        return values

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        (slope,) = ctx.saved_tensors
        return gradient * slope, None, None
