"""The kit's promises: the same bytes each time, within budget, sound meshes, textures that tile, known labels."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest

from authoring import kit
from authoring.kit.cores import core
from authoring.kit.leaves import lump, on_masses
from authoring.kit.parts import Sink
from authoring.kit.props import MAKERS, PROPS, write_prop
from authoring.materials import MATERIALS, material_xml
from authoring.materials.atlas import TRAFFIC_SIGNS
from authoring.materials.build import TEXTURES, registered_stems
from authoring.materials.palette import SWATCHES, swatch_rect
from authoring.materials.registry import Material
from authoring.mesh import write_obj
from gear.values.rng import derive_rng

DOCS = Path(__file__).parents[2] / "docs" / "reference" / "mjcf.md"
Maker = Callable[[np.random.Generator], list[kit.Part]]

SMALL_THINGS: dict[str, Maker] = {
    **MAKERS,
    "fence_bars": lambda rng: kit.fence(8.0),
    "fence_mesh": lambda rng: kit.fence(8.0, style="mesh"),
    "fence_wood": lambda rng: kit.fence(8.0, style="wood"),
    "wall": lambda rng: kit.wall(8.0),
    "guard_rail": lambda rng: kit.guard_rail(8.0),
    "bridge_railing": lambda rng: kit.bridge_railing(8.0),
    "jersey_barrier": lambda rng: kit.jersey_barrier(4.0),
    "cafe": lambda rng: kit.cafe(rng),
    "cable_box": lambda rng: kit.cable_box(),
    "power_pole": lambda rng: kit.power_pole(),
    "grass": lambda rng: kit.grass_tufts((3.0, 2.0), 40, rng),
    **{f"cover_{k}": lambda rng, k=k: kit.road_cover(k) for k in ("manhole", "manhole_square", "drain", "tree_grate")},
    **{f"planter_{k}": lambda rng, k=k: kit.planter(k, rng) for k in ("box", "round", "wood")},
    **{f"lamp_{k}": lambda rng, k=k: kit.street_lamp(style=k) for k in ("modern", "double", "heritage")},
    **{f"traffic_sign_{k}": lambda rng, k=k: kit.traffic_sign(k) for k in TRAFFIC_SIGNS},
}


def a_building(style: str, seed: int = 0, lod: str = "near", floors: int = 5) -> list[kit.Part]:
    rng = derive_rng(seed, "kit", style)
    return kit.building(
        style=style, width_m=20.0, depth_m=14.0, floors=floors, rng=rng, sides=("front", "right"), lod=lod
    )


def known_labels() -> set[str]:
    rows = re.findall(r"^\| ([a-z_, /]+) \|", DOCS.read_text(encoding="utf-8"), re.MULTILINE)
    return {label.strip() for row in rows for label in re.split(r"[,/]", row)} - {"label"}


def check_sound(parts: list[kit.Part]) -> None:
    assert parts
    for part in parts:
        mesh = part.mesh
        assert mesh.normals is not None
        for array in (mesh.vertices, mesh.uvs, mesh.normals):
            assert np.isfinite(array).all()
        assert mesh.faces.min() >= 0
        assert mesh.faces.max() < len(mesh.vertices)
        assert mesh.face_areas().min() > 1e-8, f"{part.material}: a face without area"
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-6)
        assert part.material in MATERIALS
        assert part.label in known_labels()
        if MATERIALS[part.material].tile_m == 0 and not part.material.startswith(("awnings", "far_facades")):
            assert mesh.uvs.min() >= 0
            assert mesh.uvs.max() <= 1


def facing(part: kit.Part) -> np.ndarray:
    """How well each face's winding agrees with its normals: 1 is quite, -1 is inside out."""
    assert part.mesh.normals is not None
    corners = part.mesh.vertices[part.mesh.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    return np.einsum("ij,ij->i", flat, part.mesh.normals[part.mesh.faces].mean(1))


@pytest.mark.parametrize("style", kit.STYLES)
def test_near_building_is_sound_and_within_budget(style: str) -> None:
    parts = a_building(style)
    check_sound(parts)
    assert 700 <= kit.triangle_count(parts) <= 8500
    assert {part.label for part in parts} == {"building"}
    assert all(facing(part).min() > 0.5 for part in parts)


@pytest.mark.parametrize("style", kit.STYLES)
@pytest.mark.parametrize("floors", [1, 6, 40])
def test_far_building_is_cheap_and_as_large_as_the_near_one(style: str, floors: int) -> None:
    far = a_building(style, lod="far", floors=floors)
    check_sound(far)
    assert kit.triangle_count(far) < 200
    heights = [max(p.mesh.vertices[:, 2].max() for p in a_building(style, lod=lod)) for lod in ("near", "far")]
    assert heights[1] == pytest.approx(heights[0], rel=0.4)


@pytest.mark.parametrize("style", kit.STYLES)
@pytest.mark.parametrize("seed", range(6))
def test_any_draw_of_a_building_is_sound(style: str, seed: int) -> None:
    rng = derive_rng(seed, "any", style)
    parts = kit.building(
        style=style,
        width_m=float(rng.uniform(5, 40)),
        depth_m=float(rng.uniform(5, 30)),
        floors=int(rng.integers(1, 12)),
        rng=rng,
        sides=("back", "left", "front"),
    )
    check_sound(parts)


def test_whatever_comes_through_a_wall_meets_the_core_or_the_ceiling() -> None:
    """Lines of sight from the street through any point of the front, four metres off its corners, up to the ceiling."""
    width, depth, top = 14.0, 11.0, 12.0
    sink = Sink("building")
    core(sink, width, depth, top, ground_m=4.0)
    (part,) = sink.parts()
    corners = np.asarray(part.mesh.vertices)[np.asarray(part.mesh.faces)]
    origin, first, second = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    rng = np.random.default_rng(5)
    for _ in range(400):
        eye = np.array([rng.uniform(-12, 12), -depth / 2 - rng.uniform(6, 30), 1.65])
        entry = np.array([rng.uniform(4, width - 4) - width / 2, -depth / 2, rng.uniform(0.6, top - 0.05)])
        along = entry - eye
        # Moeller and Trumbore, 1997, for the faces that look at the eye.
        across = np.cross(along, second)
        facing = (first * across).sum(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((entry - origin) * across).sum(1) / facing
            other = np.cross(entry - origin, first)
            v, t = (other @ along) / facing, (second * other).sum(1) / facing
        assert ((facing > 1e-9) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)).any(), (eye, entry)


def test_a_building_keeps_to_its_plot_but_for_what_hangs_over_the_street() -> None:
    for style in kit.STYLES:
        points = np.concatenate([part.mesh.vertices for part in a_building(style)])
        assert points[:, 2].min() > -0.7
        assert np.abs(points[:, 0]).max() < 10 + 2.5
        assert np.abs(points[:, 1]).max() < 7 + 2.5
        assert points[:, 0].min() > -10.4, f"{style} reaches into its neighbour"


def test_same_rng_same_bytes_other_rng_other_building(tmp_path: Path) -> None:
    def digest(seed: int, name: str) -> list[bytes]:
        parts = a_building("brick_apartment", seed) + kit.tree("broad", 8.0, derive_rng(seed, "tree"))
        for index, part in enumerate(parts):
            write_obj(tmp_path / f"{name}{index}.obj", part.mesh)
        return [(tmp_path / f"{name}{index}.obj").read_bytes() for index in range(len(parts))]

    assert digest(1, "a") == digest(1, "b")
    assert digest(1, "a") != digest(2, "c")


@pytest.mark.parametrize("species", list(kit.SPECIES))
def test_trees_are_sound_within_budget_and_as_high_as_asked(species: str) -> None:
    for lod, low, high in (("near", 2000, 4500), ("far", 150, 450)):
        parts = kit.tree(species, 9.0, derive_rng(3, species), lod=lod)
        check_sound(parts)
        assert low <= kit.triangle_count(parts) <= high
        assert {part.label for part in parts} == {"vegetation"}
        top = max(part.mesh.vertices[:, 2].max() for part in parts)
        assert 0.85 * 9 < top < 1.2 * 9


def test_leaves_are_seen_from_both_sides() -> None:
    crown = next(p for p in kit.tree("broad", 8.0, derive_rng(0, "tree")) if p.material.startswith("foliage"))
    agreement = facing(crown)
    assert (agreement < 0).sum() > 1000
    assert (agreement > 0).sum() > 1000


def outline_share(parts: list[kit.Part], turn_rad: float) -> float:
    """How much of the convex hull of a crown's outline its leaves fill, seen from one side."""
    crown = np.concatenate([p.mesh.vertices[p.mesh.faces] for p in parts if p.material.startswith("foliage")])
    flat = np.stack([crown @ (np.cos(turn_rad), np.sin(turn_rad), 0.0), crown[..., 2]], -1)
    pixels = ((flat - flat.reshape(-1, 2).min(0)) * 40 + 4).astype(np.int32)
    image = np.zeros(pixels.reshape(-1, 2).max(0)[::-1] + 8, np.uint8)
    for triangle in pixels:
        cv2.fillConvexPoly(image, triangle, 1)
    return float(image.sum() / cv2.contourArea(cv2.convexHull(np.argwhere(image).astype(np.int32))))


@pytest.mark.parametrize("species", list(kit.SPECIES))
def test_crowns_are_no_balls_and_no_two_are_alike(species: str) -> None:
    """A ball fills all of its hull; boughs with gaps between them do not, each tree in another way."""
    shares = [
        outline_share(kit.tree(species, 8.0, derive_rng(seed, species)), turn)
        for seed in range(5)
        for turn in (0.0, 1.5)
    ]
    assert np.mean(shares) < 0.87
    assert np.std(shares) > 0.008


@pytest.mark.parametrize("style", sorted(set(kit.STYLES) - {"glass_office"}))
def test_no_party_wall_is_blank_but_where_a_neighbour_stands(style: str) -> None:
    def on_the_left(covered_m: float, seed: int) -> tuple[int, float]:
        """Faces before and behind the plane of the left side, and how low they begin."""
        parts = kit.building(
            style=style, width_m=9.0, depth_m=14.0, floors=6, rng=derive_rng(seed, "party", style),
            sides=("front",), covered_m={"left": covered_m},
        )  # fmt: skip
        middles = np.concatenate([part.mesh.vertices[part.mesh.faces].mean(1) for part in parts])
        off_m = -4.5 - middles[:, 0]
        near = middles[
            (off_m > -0.24) & (np.abs(off_m) > 0.01) & (np.abs(middles[:, 1]) < 6.2) & (middles[:, 2] < 17.0)
        ]
        return len(near), float(near[:, 2].min()) if len(near) else np.inf

    open_sides = [on_the_left(0.0, seed)[0] for seed in range(6)]
    assert min(open_sides) >= 2
    assert all(on_the_left(9.0, seed)[1] > 8.9 for seed in range(6))


def test_leaves_grow_on_the_outside_of_overlapping_masses() -> None:
    rng = derive_rng(0, "masses")
    centres, radii_m = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), np.full((2, 3), 0.8)
    middle = centres.mean(0)
    sink = Sink("vegetation")
    masses = [lump(sink, "foliage_green", *one, around=middle, detail=1, rng=rng)
              for one in zip(centres, radii_m, strict=True)]  # fmt: skip
    feet, outward = on_masses(masses, centres, radii_m, count=500, around=middle, rng=rng)
    assert feet.shape == outward.shape == (500, 3)
    np.testing.assert_allclose(np.linalg.norm(outward, axis=1), 1, atol=1e-9)
    near = np.abs(np.linalg.norm(feet[:, None] - centres, axis=2) / 0.8 - 0.95)
    assert near.min(1).max() < 0.2, "on a surface"
    assert np.linalg.norm(feet[:, None] - centres, axis=2).min(1).min() > 0.8 * 0.7, "in neither mass"
    assert (np.einsum("nx,nx->n", outward, feet - middle) > 0).mean() > 0.95
    halves = (feet[:, 0] < 0.5).mean()
    assert 0.4 < halves < 0.6, "evenly over both"


@pytest.mark.parametrize("name", sorted(SMALL_THINGS))
def test_small_things_are_sound_and_stand_on_the_ground(name: str) -> None:
    parts = SMALL_THINGS[name](derive_rng(0, "small", name))
    check_sound(parts)
    lowest = min(part.mesh.vertices[:, 2].min() for part in parts)
    assert -0.35 < lowest < 0.1


def back_share(parts: list[kit.Part], rng: np.random.Generator, eyes: np.ndarray, targets: np.ndarray) -> float:
    """How many of the rays that hit meet the back of a face that has no front at the same place."""
    spec = mujoco.MjSpec()
    for index, part in enumerate(kit.merge(parts)):
        corners = np.round(part.mesh.vertices[part.mesh.faces] * 1e3).astype(int).reshape(len(part.mesh.faces), -1)
        key = np.sort(corners.reshape(-1, 3, 3).view("i8,i8,i8"), axis=1).reshape(len(corners), 3)
        _, which, count = np.unique(key, axis=0, return_inverse=True, return_counts=True)
        for kind, keep in (("single", count[which.ravel()] == 1), ("twin", count[which.ravel()] > 1)):
            if keep.any():
                faces = part.mesh.faces[keep]
                used, local = np.unique(faces, return_inverse=True)
                mesh = spec.add_mesh(name=f"{kind}{index}", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
                # A mesh needs four vertices: the first one stands in for what a lone triangle lacks.
                points = np.concatenate([part.mesh.vertices[used], part.mesh.vertices[used][:1] + 1e-3])
                mesh.uservert, mesh.userface = points.ravel(), local.ravel()
                spec.worldbody.add_geom(
                    name=f"{kind}{index}",
                    type=mujoco.mjtGeom.mjGEOM_MESH,
                    meshname=f"{kind}{index}",
                    contype=0,
                    conaffinity=0,
                )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hits = backs = 0
    for eye, target in zip(eyes, targets, strict=True):
        along = (target - eye) / np.linalg.norm(target - eye)
        geom, normal = np.zeros(1, np.int32), np.zeros(3)
        if mujoco.mj_ray(model, data, eye, along, None, 1, -1, geom, normal) >= 0:
            hits += 1
            backs += int(normal @ along > 0 and model.geom(int(geom[0])).name.startswith("single"))
    assert hits > 50
    return backs / hits


@pytest.mark.parametrize("style", kit.STYLES)
def test_from_the_street_no_back_of_a_building_is_seen(style: str) -> None:
    """Renderers leave out backs and rays do not: a hole or a wrong winding would set depth and picture apart."""
    rng = derive_rng(0, "backs", style)
    eyes = np.stack([rng.uniform(-40, 40, 800), rng.uniform(-40, -12, 800), rng.choice([1.65, 8.0, 30.0], 800)], 1)
    targets = np.stack([rng.uniform(-10, 10, 800), rng.uniform(-7.5, -6, 800), rng.uniform(0, 20, 800)], 1)
    assert back_share(a_building(style), rng, eyes, targets) < 0.003


@pytest.mark.parametrize("name", sorted(SMALL_THINGS))
def test_no_back_of_a_small_thing_is_seen(name: str) -> None:
    rng = derive_rng(0, "backs", name)
    parts = SMALL_THINGS[name](rng)
    points = np.concatenate([part.mesh.vertices for part in parts])
    angle, reach = rng.uniform(0, 2 * np.pi, 300), rng.uniform(7, 14, 300)
    eyes = np.stack([reach * np.cos(angle), reach * np.sin(angle), rng.uniform(0.5, 3.5, 300)], 1)
    targets = points[rng.integers(len(points), size=300)] + rng.uniform(-0.02, 0.02, (300, 3))
    assert back_share(parts, rng, eyes, targets) < 0.02


def test_countable_things_have_the_labels_that_datasets_count() -> None:
    rng = np.random.default_rng(0)
    expected = {
        "stop_sign": kit.traffic_sign("stop"),
        "traffic_sign": kit.traffic_sign("yield"),
        "traffic_light": kit.traffic_light(),
        "bench": kit.bench(),
        "fire_hydrant": kit.fire_hydrant(),
        "parking_meter": kit.parking_meter(),
        "fence": kit.fence(4.0),
        "wall": kit.wall(4.0),
        "guard_rail": kit.guard_rail(4.0),
        "bridge": kit.bridge_railing(4.0),
        "pole": kit.street_lamp(),
        "static": kit.bus_stop(rng),
    }
    for label, parts in expected.items():
        assert label in {part.label for part in parts}


@pytest.mark.parametrize("name", sorted(TRAFFIC_SIGNS))
def test_only_the_side_of_a_sign_that_says_something_is_a_sign(name: str) -> None:
    rng = np.random.default_rng(0)
    parts = [part for part in kit.traffic_sign(name) if part.label != "pole"]
    eyes = np.stack([rng.uniform(-2, 2, 50), np.full(50, 9.0), rng.uniform(1, 3, 50)], 1)
    assert len({part.label for part in parts}) == 2
    for part in parts:
        corners = part.mesh.vertices[np.asarray(part.mesh.faces)]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        is_seen_from_behind = ((eyes[:, None] - corners[:, 0]) * normals).sum(-1) > 1e-9
        if part.label in ("traffic_sign", "stop_sign"):
            assert not is_seen_from_behind.any()
        else:
            assert part.label == "traffic_sign_back"
            assert is_seen_from_behind.any()


def test_place_turns_counter_clockwise_and_then_moves() -> None:
    (part,) = [
        p for p in kit.place(kit.traffic_sign("stop"), x_m=5.0, yaw_rad=np.pi / 2) if p.material == "traffic_signs"
    ]
    assert part.mesh.normals is not None
    np.testing.assert_allclose(part.mesh.normals.mean(0), (1.0, 0.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(part.mesh.vertices[:, :2].mean(0), (5.005, 0.0), atol=1e-6)


def test_merge_makes_one_part_a_material_and_label() -> None:
    parts = kit.bench() + kit.place(kit.bench(), x_m=3.0) + kit.traffic_light()
    merged = kit.merge(parts)
    keys = [(part.material, part.label) for part in merged]
    assert len(keys) == len(set(keys)) == 4
    assert kit.triangle_count(merged) == kit.triangle_count(parts)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda rng: kit.building(style="castle", width_m=9, depth_m=9, floors=2, rng=rng), "no building style"),
        (lambda rng: kit.building(style="shop_row", width_m=2, depth_m=9, floors=2, rng=rng), "too small"),
        (lambda rng: kit.tree("palm", 5.0, rng), "no tree species"),
        (lambda rng: kit.traffic_sign("halt"), "no traffic sign"),
        (lambda rng: kit.fence(3.0, style="hedge"), "no fence style"),
        (lambda rng: kit.traffic_light(lit="blue"), "not 'blue'"),
        (lambda rng: material_xml(["gold"]), "no material"),
    ],
)
def test_wrong_names_are_refused(call: Callable[[np.random.Generator], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(np.random.default_rng(0))


def texture(stem: str) -> np.ndarray:
    bgr = cv2.imread(str(TEXTURES / f"{stem}.png"))
    assert bgr is not None
    return bgr[..., ::-1].astype(float)


def edge_jump(image: np.ndarray, axis: int) -> float:
    """The step across the wrap, relative to the largest step (a joint, say) between neighbours inside."""
    lines = np.moveaxis(image, axis, 0)
    usual = np.abs(np.diff(lines, axis=0)).mean((1, 2))
    return float(np.abs(lines[0] - lines[-1]).mean() / max(usual.max(), 0.5))


TILING = {stem for m in MATERIALS.values() if m.tile_m for stem in (m.rgb, m.normal, m.orm) if stem} - {
    "curtain_wall",
    "curtain_wall_n",
    "curtain_wall_orm",
}


@pytest.mark.parametrize("stem", sorted(TILING))
def test_tiling_textures_continue_over_their_edges(stem: str) -> None:
    image = texture(stem)
    assert edge_jump(image, 0) < 1.3
    assert edge_jump(image, 1) < 1.3


def test_the_tiling_test_notices_a_seam() -> None:
    image = texture("plaster") + np.linspace(0, 60, 512)[:, None, None]
    assert edge_jump(image, 0) > 1.3


def test_textures_are_complete_power_of_two_and_small() -> None:
    total = 0
    for stem in registered_stems():
        path = TEXTURES / f"{stem}.png"
        total += path.stat().st_size
        assert all(side & (side - 1) == 0 for side in texture(stem).shape[:2]), stem
    assert total < 13e6


def linear(image: np.ndarray) -> np.ndarray:
    unit = image / 255
    return np.where(unit <= 0.04045, unit / 12.92, ((unit + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("asphalt", 0.07, 0.12),
        ("asphalt_worn", 0.07, 0.13),
        ("pavement", 0.28, 0.45),
        ("concrete", 0.28, 0.45),
        ("road_paint_white", 0.5, 0.75),
        ("grass", 0.04, 0.15),
        ("foliage_green", 0.02, 0.15),
        ("brick_red", 0.08, 0.25),
        ("plaster_white", 0.55, 0.85),
        ("soil", 0.03, 0.1),
    ],
)
def test_albedo_is_what_such_a_surface_has(name: str, low: float, high: float) -> None:
    material: Material = MATERIALS[name]
    albedo = (linear(texture(material.rgb)) * material.tint).mean()
    assert low < albedo < high


def test_swatches_do_not_overlap() -> None:
    rects = [swatch_rect(name) for name in SWATCHES]
    assert len({(u0, v0) for u0, v0, _, _ in rects}) == len(rects)
    assert all(0 <= u0 < u1 <= 1 and 0 <= v0 < v1 <= 1 for u0, v0, u1, v1 in rects)


def test_props_on_disk_are_what_the_kit_makes_and_open_in_the_viewer(tmp_path: Path) -> None:
    for name in ("bench_wood", "tree_street"):
        write_prop(name, tmp_path)
        made = sorted(p.relative_to(tmp_path) for p in tmp_path.rglob(f"{name}*/*.obj"))
        assert made
        for path in [*made, Path(f"{name}.xml")]:
            assert (tmp_path / path).read_bytes() == (PROPS / path).read_bytes(), path
    for name in MAKERS:
        model = mujoco.MjModel.from_xml_path(str(PROPS / f"{name}.xml"))
        solid = model.geom("solid")
        assert solid.group == 3
        assert (model.geom_group == 3).sum() == 1
