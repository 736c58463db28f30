"""The camera's response and its fixed linear effects in torch, for gradients. Only what trains imports it."""

from __future__ import annotations

import torch

from gear.camera.optics import LensMap
from gear.camera.response import Response


def apply(response: Response, light: torch.Tensor) -> torch.Tensor:
    """`Response.curve` on tensors, differentiable.

    Args:
        response: the camera setting.
        light: (...) float, linear, 0..1; clamped, as the frame's full scale clips it.

    Returns:
        (...) of the same dtype, picture values 0..1, not rounded to bytes.
    """
    x = light.clamp(0.0, 1.0)
    y = x * response.exposure / (1 + (response.exposure - 1) * x)
    # A power has no finite gradient at 0.
    z = y.clamp_min(1e-12) ** response.contrast if response.contrast != 1 else y
    return encode_srgb(z) if response.encoding == "srgb" else z


def face_light(renderer_name: str, face: torch.Tensor) -> torch.Tensor:
    """`gear.camera.face_light` on picture values 0..1, differentiable."""
    return face if renderer_name == "classic" else decode_srgb(face)


def vignetted(light: torch.Tensor, share: torch.Tensor) -> torch.Tensor:
    """`gear.camera.optics.vignetted` without rounding: (..., C, H, W) light times the (H, W) of `vignette_map`."""
    return light * share


def through_lens(light: torch.Tensor, lens: LensMap) -> torch.Tensor:
    """`gear.camera.optics.through_lens` for colour, without rounding: (N, C, H, W) light, bilinear."""
    height, width = light.shape[-2:]
    x = torch.as_tensor(lens.x.copy(), dtype=light.dtype, device=light.device) * (2 / (width - 1)) - 1
    y = torch.as_tensor(lens.y.copy(), dtype=light.dtype, device=light.device) * (2 / (height - 1)) - 1
    grid = torch.stack([x, y], dim=-1).expand(light.shape[0], -1, -1, -1)
    return torch.nn.functional.grid_sample(light, grid, mode="bilinear", padding_mode="border", align_corners=True)


def encode_srgb(light: torch.Tensor) -> torch.Tensor:
    """Linear light 0..1 to sRGB values 0..1."""
    bent = 1.055 * light.clamp_min(0.0031308) ** (1 / 2.4) - 0.055
    return torch.where(light <= 0.0031308, light * 12.92, bent)


def decode_srgb(values: torch.Tensor) -> torch.Tensor:
    """sRGB values 0..1 to linear light 0..1."""
    bent = ((values.clamp_min(0.04045) + 0.055) / 1.055) ** 2.4
    return torch.where(values <= 0.04045, values / 12.92, bent)
