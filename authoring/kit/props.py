"""Writes single pieces of street furniture and sample trees as MJCF: `python -m authoring.kit.props [FOLDER]`.

Each file opens in the stock viewer. A piece stands at the origin of its file and shows its front towards -y.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from authoring.kit.furniture import bench, bin_, bollard, dumpster, fire_hydrant, letter_box, parking_meter
from authoring.kit.parts import Part, merge
from authoring.kit.places import advertising_pillar, bus_stop
from authoring.kit.plants import hedge, planter, shrub
from authoring.kit.signals import street_lamp, traffic_light, traffic_light_mast
from authoring.kit.signs import street_name_sign, traffic_sign
from authoring.kit.trees import SPECIES, tree
from authoring.materials import material_xml
from authoring.mesh import write_obj
from gear.values.rng import derive_rng

Array = npt.NDArray[np.float64]
Maker = Callable[[np.random.Generator], list[Part]]
PROPS = Path(__file__).resolve().parents[2] / "mjcf" / "props"
# What is higher than this cannot be touched by anything that drives, and casts no collision box.
REACH_M = 2.2
SIGNS = ("stop", "yield", "priority", "no_entry", "speed_30", "speed_50", "one_way", "parking", "crossing")


def _makers() -> dict[str, Maker]:
    """Returns the generator of every prop, by the name of its file."""
    makers: dict[str, Maker] = {
        "bench_wood": lambda rng: bench(),
        "bench_stone": lambda rng: bench(style="stone"),
        "bin_post": lambda rng: bin_(),
        "bin_steel": lambda rng: bin_(style="steel"),
        "bollard": lambda rng: bollard(),
        "bus_stop": bus_stop,
        "advertising_pillar": advertising_pillar,
        "dumpster": lambda rng: dumpster(),
        "fire_hydrant": lambda rng: fire_hydrant(),
        "hedge": lambda rng: hedge(4.0, 1.2, 0.7, rng),
        "lamp_heritage": lambda rng: street_lamp(style="heritage"),
        "lamp_modern": lambda rng: street_lamp(),
        "letter_box": lambda rng: letter_box(),
        "parking_meter": lambda rng: parking_meter(),
        "planter": lambda rng: planter("box", rng),
        "shrub": lambda rng: shrub(1.1, rng),
        "sign_street_name": lambda rng: street_name_sign(),
        "traffic_light_mast": lambda rng: traffic_light_mast(),
    }
    makers |= {f"traffic_light_{lit}": _traffic_light(lit) for lit in ("red", "amber", "green")}
    makers |= {f"sign_{name}": _sign(name) for name in SIGNS}
    makers |= {f"tree_{species}": _tree(species) for species in SPECIES}
    return makers


def _traffic_light(lit: str) -> Maker:
    return lambda rng: traffic_light(lit=lit)


def _sign(name: str) -> Maker:
    return lambda rng: traffic_sign(name)


def _tree(species: str) -> Maker:
    return lambda rng: tree(species, 8.0, rng)


MAKERS = _makers()


def write_prop(name: str, folder: Path) -> None:
    """Write `<name>.xml` and its meshes into `folder`."""
    parts = merge(MAKERS[name](derive_rng(0, "props", name)))
    meshes = folder / name
    meshes.mkdir(parents=True, exist_ok=True)
    classes = {part: f"{part.label}.{part.material}" for part in parts}
    for part in parts:
        write_obj(meshes / f"{part.label}_{part.material}.obj", part.mesh, is_patchwork=True)
    centre, half = _solid(parts)
    lines = [
        f'<mujoco model="{name}">',
        "  <!-- Made by `python -m authoring.kit.props`. -->",
        f'  <compiler angle="degree" balanceinertia="true" meshdir="{name}" texturedir="../textures"/>',
        "  <default>",
        '    <default class="seen">',
        '      <mesh inertia="shell"/>',
        '      <geom type="mesh" group="1" contype="0" conaffinity="0" mass="0"/>',
        *[f'      <default class="{label}"/>' for label in classes.values()],
        "    </default>",
        '    <default class="collision">',
        '      <geom type="box" group="3"/>',
        "    </default>",
        "  </default>",
        "  <asset>",
        *[f"    {line}" for line in material_xml([p.material for p in parts], texture_dir="").splitlines()],
        *[f'    <mesh class="seen" file="{part.label}_{part.material}.obj"/>' for part in parts],
        "  </asset>",
        "  <worldbody>",
        f'    <body name="{name}">',
        *[
            f'      <geom class="{label}" mesh="{part.label}_{part.material}" material="{part.material}"/>'
            for part, label in classes.items()
        ],
        f'      <geom name="solid" class="collision" pos="{_row(centre)}" size="{_row(half)}"/>',
        "    </body>",
        "  </worldbody>",
        "</mujoco>",
        "",
    ]
    (folder / f"{name}.xml").write_text("\n".join(lines), encoding="ascii", newline="\n")


def _solid(parts: list[Part]) -> tuple[Array, Array]:
    """Returns centre and half size of the box around the solid parts: the trunk of a tree, but not its crown."""
    hard = [p for p in parts if not p.material.startswith("foliage")] or parts
    points = np.concatenate([part.mesh.vertices for part in hard])
    low_points = points[points[:, 2] < REACH_M]
    low, high = low_points.min(0), low_points.max(0)
    return (low + high) / 2, np.maximum((high - low) / 2, 0.01)


def _row(values: Array) -> str:
    return " ".join(f"{value:.3f}".rstrip("0").rstrip(".") for value in values)


if __name__ == "__main__":
    for prop in MAKERS:
        write_prop(prop, Path(sys.argv[1]) if len(sys.argv) > 1 else PROPS)
