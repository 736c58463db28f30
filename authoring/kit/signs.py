"""Traffic signs on their posts. A sign faces -y, towards approaching drivers."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from authoring.kit.parts import Part, Sink, place
from authoring.kit.shapes import cylinder, disc
from authoring.materials.atlas import TRAFFIC_SIGNS, traffic_sign_rect

Array = npt.NDArray[np.float64]
THICK_M = 0.012


def _ring(sides: int, first_deg: float) -> Array:
    angle = np.radians(first_deg + np.arange(sides) * 360 / sides)
    return np.stack([np.cos(angle), np.sin(angle)], 1)


def _rounded_triangle(corners: list[tuple[float, float]]) -> Array:
    """Returns the outline of a triangle with rounded corners."""
    tips = np.asarray(corners)
    centre = tips.mean(0)
    angle = np.radians((-50, 0, 50))
    rounded = []
    for tip in tips:
        along = (tip - centre) / np.linalg.norm(tip - centre)
        side = np.array([-along[1], along[0]])
        rounded += [tip + 0.1 * ((np.cos(a) - 1.15) * along + np.sin(a) * side) for a in angle]
    return np.stack(rounded)


# Outlines (K, 2) in -1..1, counter-clockwise as the driver sees them: x right, y up; and half the height in metres.
_ROUND = (_ring(16, 0), 0.3)
_SQUARE = (np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * 0.98, 0.3)
OUTLINES: dict[str, tuple[Array, float]] = {
    "stop": (_ring(8, 22.5) / np.cos(np.pi / 8) * 0.98, 0.38),
    "yield": (_rounded_triangle([(0, -0.9), (0.98, 0.8), (-0.98, 0.8)]), 0.45),
    "warning_children": (_rounded_triangle([(-0.98, -0.8), (0.98, -0.8), (0, 0.9)]), 0.45),
    "priority": (np.array([(0, -0.98), (0.98, 0), (0, 0.98), (-0.98, 0)]), 0.42),
    "one_way": (np.array([(-1, -0.4), (1, -0.4), (1, 0.4), (-1, 0.4)]) * 0.98, 0.45),
    "street_name": (np.array([(-1, -0.25), (1, -0.25), (1, 0.25), (-1, 0.25)]) * 0.98, 0.5),
    "bus_stop": _SQUARE,
    "parking": _SQUARE,
    "crossing": _SQUARE,
    "chevron": _SQUARE,
}


BACK = "traffic_sign_back"
"""Label of rims and backs; in the classes of Cityscapes, only the printed side is a traffic sign."""


def traffic_sign(*names: str, post_m: float = 2.2) -> list[Part]:
    """Makes a post with one sign, or with several signs from the top downwards, which face -y.

    Args:
        names: names of signs in `authoring.materials.atlas.TRAFFIC_SIGNS`.
        post_m: height of the lower edge of the lowest sign above the ground, metres.

    Returns:
        The post (label `pole`), the signs (label `traffic_sign`, or `stop_sign` for the octagon) and their backs.
    """
    unknown = sorted(set(names) - set(TRAFFIC_SIGNS))
    if unknown or not names:
        raise ValueError(f"no traffic sign named {', '.join(unknown)}; there are {', '.join(TRAFFIC_SIGNS)}")
    sink = Sink("traffic_sign")
    z = post_m
    for name in reversed(names):
        outline, half_m = OUTLINES.get(name, _ROUND)
        half_v = half_m * float(outline[:, 1].max() - outline[:, 1].min()) / 2
        z += half_v
        _plate(sink, name, outline, half_m, z - half_m * float(outline[:, 1].max() + outline[:, 1].min()) / 2)
        z += half_v + 0.04
    cylinder(sink, "galvanised", (0, 0.035, 0), 0.032, z - 0.02, segments=8, label="pole")
    disc(sink, "concrete_dark", (0, 0.035, 0.004), 0.09, segments=8, label="pole")
    return sink.parts()


def street_name_sign(height_m: float = 2.9) -> list[Part]:
    """Two crossed street-name plates on a post."""
    sink = Sink("traffic_sign")
    outline, half_m = OUTLINES["street_name"]
    cylinder(sink, "galvanised", (0, 0, 0), 0.035, height_m - 0.12, segments=10, label="pole")
    for level, yaw_rad in ((height_m, 0.0), (height_m + 0.26, np.pi / 2)):
        plate = Sink("traffic_sign")
        for flip in (1, -1):
            _plate(plate, "street_name", outline, half_m, level, offset_m=-THICK_M / 2, flip=flip, back=False)
        sink.extend(place(plate.parts(), yaw_rad=yaw_rad))
    return sink.parts()


def _plate(
    sink: Sink,
    name: str,
    outline: Array,
    half_m: float,
    z_m: float,
    *,
    offset_m: float = -0.005,
    flip: int = 1,
    back: bool = True,
) -> None:
    """Adds one plate: picture, rim and grey back. Only the picture has the label of a sign (see `BACK`)."""
    label = "stop_sign" if name == "stop" else "traffic_sign"
    u0, v0, u1, v1 = traffic_sign_rect(name)
    uvs = np.array([(u0 + u1) / 2, (v0 + v1) / 2]) + outline * ((u1 - u0) / 2, (v1 - v0) / 2)
    flat = outline * half_m
    count = len(outline)
    front = np.column_stack([flat[:, 0] * flip, np.full(count, offset_m * flip), flat[:, 1] + z_m])
    sink.polygon("traffic_signs", front, uvs, label=label)
    rear = front + np.array([0.0, THICK_M * flip, 0.0])
    if back:
        normal = np.tile([0.0, 1.0, 0.0], (count, 1))
        faces = [(0, i + 1, i) for i in range(1, count - 1)]
        sink.swatch_mesh("galvanised", rear, faces, normal, label=BACK)
    for i in range(count):
        j = (i + 1) % count
        sink.swatch_quad("galvanised", [front[j], front[i], rear[i], rear[j]], label=BACK)
