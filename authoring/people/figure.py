"""Models a person in a pose: skeleton, clothes and skin become at most six meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from authoring.mesh import Mesh
from authoring.people.body import bare_arms, bare_legs
from authoring.people.extras import phone
from authoring.people.garments import Garment
from authoring.people.head import head_piece
from authoring.people.key_points import KeyPoints, coco_key_points
from authoring.people.piece import Piece, Skin, combine, mesh_pieces
from authoring.people.skeleton import ANKLE_M, SIDES, Build, Pose, Skeleton, pose_skeleton
from authoring.people.texture import Colour, Face, atlas_uv, skin_uv

GROUPS = ("paint", "cloth", "skin", "hair", "shoes", "extra")


@dataclass(frozen=True, slots=True, kw_only=True)
class Person:
    """A person to model.

    Attributes:
        name: name of the files.
        build: proportions of the body.
        face: features that are painted on the face; its hair colour is also that of the hair.
        wear: garments, hair, shoes and bags.
        palette: rows of (r, g, b, weight), linear albedo of the garment whose colour a sample draws.
        colours: linear albedo of all other parts, by the names that the garments use.
        poses: the poses to model.
        bare: limbs without clothes, of `arms` and `legs`.
    """

    name: str
    build: Build
    face: Face
    wear: tuple[Garment, ...]
    palette: tuple[tuple[float, float, float, float], ...]
    colours: dict[str, Colour]
    poses: tuple[Pose, ...]
    bare: tuple[str, ...] = ()

    @property
    def atlas(self) -> dict[str, Colour]:
        """All colours of the atlas of cloth by name; `paint` is white, so that it shows the colour of the geom."""
        fixed: dict[str, Colour] = {
            "paint": (1.0, 1.0, 1.0),
            "hair": self.face.hair,
            "white": (0.62, 0.62, 0.60),
            "black": (0.015, 0.015, 0.016),
            "sole": (0.045, 0.042, 0.04),
            "shoe": (0.03, 0.028, 0.027),
        }
        return fixed | self.colours


def _lowest(skeleton: Skeleton, side: str) -> float:
    s = skeleton.build.scale
    foot, toes = skeleton[f"foot_{side}"], skeleton[f"toes_{side}"]
    heel = foot.at(-0.075 * s, 0.0, -ANKLE_M * s)[2]
    return float(min(heel, toes.origin[2], toes.at(0.085 * s, 0.0, 0.0)[2]))


def stand_on_both_feet(build: Build, pose: Pose) -> Pose:
    """Returns the pose with the knee of the lower leg bent until both soles are at the same height."""
    if not pose.grounded:
        return pose
    heights = {side: _lowest(pose_skeleton(build, pose), side) for side in SIDES}
    low = min(heights, key=lambda side: heights[side])
    target = max(heights.values())
    bend_low, bend_high = 0.0, 60.0
    for _ in range(40):
        bend = 0.5 * (bend_low + bend_high)
        if _lowest(pose_skeleton(build, _bent(pose, low, bend)), low) < target:
            bend_low = bend
        else:
            bend_high = bend
    return _bent(pose, low, bend_high)


def _bent(pose: Pose, side: str, bend: float) -> Pose:
    leg = pose.legs[side]
    return replace(pose, legs=pose.legs | {side: replace(leg, knee=leg.knee + bend, flex=leg.flex + 0.45 * bend)})


def pieces_of(person: Person, skeleton: Skeleton) -> list[Piece]:
    """Returns all pieces of a person in a pose."""
    pieces = [head_piece(skeleton), *bare_arms(skeleton, arms="arms" in person.bare)]
    if "legs" in person.bare:
        pieces += bare_legs(skeleton)
    for garment in person.wear:
        pieces += garment(skeleton)
    return pieces


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Figure:
    """A modelled person.

    Attributes:
        meshes: triangles by group, metres.
        key_points: COCO's key points in the frame of the meshes, metres.
    """

    meshes: dict[str, Mesh]
    key_points: KeyPoints

    def translated(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Figure:
        """Returns the person moved by (x, y, z) metres."""
        return Figure(
            meshes={group: mesh.translated(x, y, z) for group, mesh in self.meshes.items()},
            key_points={name: point + np.array([x, y, z]) for name, point in self.key_points.items()},
        )


def model_person(person: Person, pose: Pose) -> Figure:
    """Models a person in a pose, who stands on z = 0 with the pelvis above the origin."""
    skeleton = pose_skeleton(person.build, stand_on_both_feet(person.build, pose))
    pieces = pieces_of(person, skeleton)
    if pose.telephone:
        pieces += phone(skeleton)
    skins = mesh_pieces(pieces)
    drop_m = min(float(skin.vertices[np.unique(skin.faces), 2].min()) for skin in skins)
    figure = Figure(meshes=meshes_of(skins, person, skeleton), key_points=coco_key_points(skeleton))
    return figure.translated(z=-drop_m)


def meshes_of(skins: Sequence[Skin], person: Person, skeleton: Skeleton) -> dict[str, Mesh]:
    """Returns the meshes of all pieces of a person, by group, in the frame of the figure."""
    head = skeleton["head"]

    def uv_of(skin: Skin) -> np.ndarray:
        if skin.piece.group == "skin":
            return skin_uv(skin, head, person.build.head)
        return atlas_uv(skin, person.atlas)

    meshes = {}
    for group in GROUPS:
        members = [skin for skin in skins if skin.piece.group == group and len(skin.faces)]
        if members:
            meshes[group] = combine(members, uv_of)
    return meshes
