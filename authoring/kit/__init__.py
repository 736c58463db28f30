"""Generators of what stands in a town: buildings, vegetation, street furniture.

Every generator returns a `list[Part]`: meshes by material and semantic label, in the object's own frame (metres, z up,
the origin on the ground in the middle of the footprint). Facades, signs and signals face -y; `place` turns and moves
parts, `merge` makes one mesh of those that share a material and label, so that a block of houses is a few draw calls.
Materials are named as in `authoring.materials.MATERIALS`; `authoring.materials.material_xml` writes their MJCF.

    parts = building(style="brick_apartment", width_m=18, depth_m=12, floors=5, rng=rng, sides=("front", "right"))
    parts += place(tree("broad", 8.0, rng), x_m=4, y_m=-9)
    for part in merge(parts):
        write_obj(folder / f"{part.label}_{part.material}.obj", part.mesh, is_patchwork=True)
"""

from __future__ import annotations

from authoring.kit.barriers import bridge_railing, fence, guard_rail, jersey_barrier, seat_wall, wall
from authoring.kit.buildings import STYLES, building
from authoring.kit.furniture import (
    bench,
    bin_,
    bollard,
    cable_box,
    dumpster,
    fire_hydrant,
    letter_box,
    parking_meter,
)
from authoring.kit.parts import Part, merge, place, triangle_count
from authoring.kit.places import advertising_pillar, bus_stop, cafe, power_pole, road_cover
from authoring.kit.plants import grass_tufts, hedge, planter, shrub
from authoring.kit.signals import street_lamp, traffic_light, traffic_light_mast
from authoring.kit.signs import street_name_sign, traffic_sign
from authoring.kit.trees import SPECIES, tree

__all__ = [
    "SPECIES",
    "STYLES",
    "Part",
    "advertising_pillar",
    "bench",
    "bin_",
    "bollard",
    "bridge_railing",
    "building",
    "bus_stop",
    "cable_box",
    "cafe",
    "dumpster",
    "fence",
    "fire_hydrant",
    "grass_tufts",
    "guard_rail",
    "hedge",
    "jersey_barrier",
    "letter_box",
    "merge",
    "parking_meter",
    "place",
    "planter",
    "power_pole",
    "road_cover",
    "seat_wall",
    "shrub",
    "street_lamp",
    "street_name_sign",
    "traffic_light",
    "traffic_light_mast",
    "traffic_sign",
    "tree",
    "triangle_count",
    "wall",
]
