"""Wheels: a tyre with a tread band and rounded shoulders, and a rim with spokes over a dark drum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from authoring.mesh import Mesh, extrude, merge, revolve, rotation

__all__ = ["Wheel", "WheelSpec", "make_wheel"]


@dataclass(frozen=True)
class WheelSpec:
    """The dimensions of a wheel, metres.

    Attributes:
        radius: hub to ground.
        width: width of the tyre.
        rim: radius of the rim's edge.
        spokes: number of spokes; 0 makes a plain dished disc, as vans and lorries have.
        spoke_width: width of a spoke at the hub.
        dish: distance of the middle behind the edge of the rim.
        segments: number of segments around the tyre.
    """

    radius: float = 0.33
    width: float = 0.215
    rim: float = 0.235
    spokes: int = 5
    spoke_width: float = 0.075
    dish: float = 0.02
    segments: int = 26


@dataclass(frozen=True)
class Wheel:
    """Parts of one wheel about its hub; its outer face looks along +y."""

    tyre: Mesh
    rim: Mesh
    drum: Mesh


def make_wheel(spec: WheelSpec) -> Wheel:
    """Builds the left wheel; mirror it in y for the right."""
    r, half, rim = spec.radius, spec.width / 2, spec.rim
    tyre = revolve(
        [
            (rim - 0.002, half - 0.010),
            (rim + 0.45 * (r - rim), half),
            (r - 0.014, half - 0.010),
            (r, half - 0.035),
            (r, -half + 0.035),
            (rim + 0.02, -half),
            (0.0, -half + 0.02),
        ][::-1],
        spec.segments,
        "y",
    )
    lip = half - 0.012
    edge = [(rim + 0.006, lip - 0.004), (rim - 0.012, lip + 0.004), (rim - 0.018, lip - 0.07)]
    barrel = revolve(edge, spec.segments, "y")
    drum = revolve([(rim, lip - 0.07), (0.0, lip - 0.065)], spec.segments // 2, "y")
    if spec.spokes:
        face = _spokes(spec, lip)
    else:
        face = _dished(spec, lip)
    return Wheel(tyre, merge([barrel, face]), drum)


def _spokes(spec: WheelSpec, lip: float) -> Mesh:
    inner, outer = 0.055, spec.rim - 0.010
    w0, w1 = spec.spoke_width / 2, spec.spoke_width / 2 * 0.72
    upper = [(inner * 0.5, w0), (outer * 0.55, w1 * 0.9), (outer, w1 * 1.25)]
    spoke = extrude([*((x, -y) for x, y in upper), *reversed(upper)], 0.026, 0.007)
    top = spoke.vertices.copy()
    # Extruded along z, the spoke is laid down so that its face looks along +y, sunk towards the hub.
    sink = spec.dish * np.clip(1 - top[:, 0] / outer, 0, 1)
    laid = Mesh(np.stack([top[:, 0], top[:, 2] - sink + lip - 0.036, -top[:, 1]], axis=1), spoke.faces, spoke.uvs)
    arms = [laid.transformed(rotation("y", 360 / spec.spokes * k + 90)) for k in range(spec.spokes)]
    front = lip - spec.dish
    hub = revolve([(0.072, lip - 0.05), (0.066, front), (0.030, front), (0.0, front + 0.008)], 14, "y")
    return merge([*arms, hub])


def _dished(spec: WheelSpec, lip: float) -> Mesh:
    r, depth = spec.rim, spec.dish
    disc = revolve(
        [
            (r - 0.014, lip - 0.02),
            (0.82 * r, lip - 0.02 - 0.6 * depth),
            (0.62 * r, lip - depth - 0.02),
            (0.40 * r, lip - depth - 0.01),
            (0.36 * r, lip - depth + 0.03),
            (0.0, lip - depth + 0.035),
        ],
        spec.segments,
        "y",
    )
    nuts = []
    count = 10 if r > 0.27 else 5
    for k in range(count):
        nut = revolve([(0.016, 0.0), (0.014, 0.025), (0.0, 0.027)], 5, "y")
        at = rotation("y", 360 / count * k) @ np.array([0.51 * r, lip - depth - 0.016, 0.0])
        nuts.append(nut.translated(*at))
    return merge([disc, *nuts])
