"""Normal maps are lit from the side that they say, on meshes however they stand and however MuJoCo turns them."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from gear.contracts.rendering import Stage
from gear.render import open_renderer
from gear.values.geometry import RigidTransform
from gear.values.scene import CameraRecord, Pose
from gear.world.compilation.normal_maps import align_normal_maps, tangents

RIGHT, UP = 0.35, 0.2
"""How the map's normals lean, in shares of their length."""

OUT = math.sqrt(1 - RIGHT**2 - UP**2)
SUNS = [np.array([math.cos(a) * 0.8, math.sin(a) * 0.8, 0.6]) for a in np.radians([40, 130, 220, 310])]


def sheets() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Directions to the right and up in the texture, of surfaces as towns have them."""
    found = {}
    for azimuth_deg in (0, 20, 90, 135, 180, 270, 289):
        a = math.radians(azimuth_deg)
        found[f"wall towards {azimuth_deg}"] = (np.array([-math.sin(a), math.cos(a), 0]), np.array([0, 0, 1.0]))
        down = np.array([math.cos(a) * 0.8, math.sin(a) * 0.8, -0.6])
        found[f"roof towards {azimuth_deg}"] = (np.array([-math.sin(a), math.cos(a), 0]), -down)
        found[f"ground, up to {azimuth_deg}"] = (
            np.array([math.sin(a), -math.cos(a), 0]),
            np.array([math.cos(a), math.sin(a), 0]),
        )
    return found


def numbers(rows: object) -> str:
    return " ".join(f"{value:.9g}" for value in np.asarray(rows, dtype=np.float64).reshape(-1))


def town(sun: np.ndarray) -> tuple[mujoco.MjModel, list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]]:
    """Each surface twice, with a flat map and with one that leans: its name, normal, and the middles of both.

    What belongs together is one mesh with a scrap at its side, so that its inertia lies askew.
    """
    meshes, geoms, mesh_paths = [], [], []
    for number, (name, (right, up)) in enumerate(sheets().items()):
        normal = np.cross(right, up)
        corners = np.array([-right - up, right - up, right + up, -right + up])
        scrap = np.array([1.3 * right + 0.2 * up, 1.9 * right - 0.1 * up, 1.5 * right + 0.9 * up])
        uvs = [(0, 1), (1, 1), (1, 0), (0, 0), (0.65, 0.4), (0.95, 0.55), (0.75, 0.05)]
        meshes.append(
            f'<mesh name="m{number}" vertex="{numbers([*corners, *scrap])}" normal="{numbers([normal] * 7)}" '
            f'texcoord="{numbers(uvs)}" face="0 1 2  0 2 3  4 5 6" inertia="shell"/>'
        )
        middles = [np.array([8.0 * number, 60.0 * which, 0.0]) for which in range(2)]
        geoms += [
            f'<geom type="mesh" mesh="m{number}" material="{material}" pos="{numbers(middle)}" '
            'contype="0" conaffinity="0"/>'
            for material, middle in zip(("flat", "leaning"), middles, strict=True)
        ]
        mesh_paths.append((name, normal, middles[0], middles[1]))
    maps = {"flat": (0.5, 0.5, 1.0), "leaning": ((RIGHT + 1) / 2, (UP + 1) / 2, (OUT + 1) / 2)}
    materials = "".join(
        f'<texture name="{name}_n" type="2d" builtin="flat" rgb1="{numbers(rgb)}" width="4" height="4"/>'
        f'<material name="{name}" metallic="0" roughness="1"><layer role="rgb" texture="grey"/>'
        f'<layer role="normal" texture="{name}_n"/></material>'
        for name, rgb in maps.items()
    )
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><custom><text name="filament.material.base_color_type" data="linear"/>'
        '<numeric name="filament.ao.enabled" data="0"/></custom>'
        '<visual><headlight ambient="0 0 0" diffuse="0 0 0" specular="0 0 0"/></visual><asset>'
        '<texture name="grey" type="2d" builtin="flat" rgb1="0.8 0.8 0.8" width="4" height="4" colorspace="sRGB"/>'
        f"{materials}{''.join(meshes)}</asset><worldbody>"
        f'<light type="directional" dir="{numbers(-sun)}" diffuse="0.6 0.6 0.6" intensity="200000" castshadow="false"/>'
        f"{''.join(geoms)}</worldbody></mujoco>"
    )
    return model, mesh_paths


def facing(normal: np.ndarray, middle: np.ndarray) -> CameraRecord:
    """A camera straight before a surface."""
    across = np.cross(normal, [0.3, 0.5, 0.81])
    across /= np.linalg.norm(across)
    axes = np.stack([across, np.cross(-normal, across), -normal], axis=1)
    pose = Pose.from_transform(RigidTransform.from_parts("world", "camera", axes, middle + 3 * normal))
    return CameraRecord(name="c", width_px=16, height_px=16, focal_px=40.0, world_from_camera=pose)


@pytest.mark.parametrize("name", ["filament", "raster"])
@pytest.mark.parametrize("sun", SUNS, ids=["40", "130", "220", "310"])
def test_every_surface_is_as_bright_as_its_map_says(sun: np.ndarray, name: str) -> None:
    model, mesh_paths = town(sun)
    align_normal_maps(model)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    cameras = [facing(normal, middle) for _, normal, *middles in mesh_paths for middle in middles]
    renderer = open_renderer(name, model, quality="fast")
    try:
        views = renderer.render(Stage(model=model, data=data), cameras)
    finally:
        renderer.close()
    light = [float(view.linear_rgb[4:12, 4:12].mean()) for view in views if view.linear_rgb is not None]
    seen = 0
    for (place, normal, *_), flat, leaning in zip(mesh_paths, light[::2], light[1::2], strict=True):
        right, up = sheets()[place]
        lambert = [max(float(direction @ sun), 0.0) for direction in (normal, RIGHT * right + UP * up + OUT * normal)]
        if lambert[0] > 0.15:
            assert leaning / flat == pytest.approx(lambert[1] / lambert[0], rel=0.05), place
            seen += 1
    assert seen >= 10


def test_nothing_moves() -> None:
    model, _ = town(SUNS[0])
    before = corners(model)
    align_normal_maps(model)
    np.testing.assert_allclose(corners(model), before, atol=1e-5)


def corners(model: mujoco.MjModel) -> np.ndarray:
    """Of all triangles, in the world."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found = []
    for geom in range(model.ngeom):
        mesh = int(model.geom_dataid[geom])
        start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        points = model.mesh_vert[start : start + count].astype(np.float64)
        found.append(points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return np.concatenate(found)


def test_rays_hit_what_they_hit() -> None:
    model, mesh_paths = town(SUNS[0])
    align_normal_maps(model)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom = np.zeros(1, np.int32)
    for number, (_, normal, *middles) in enumerate(mesh_paths):
        for which, middle in enumerate(middles):
            right, up = list(sheets().values())[number]
            for offset in (0.9 * right - 0.9 * up, -0.9 * right + 0.9 * up, 1.5 * right + 0.3 * up):
                eye = middle + offset + 2 * normal
                assert mujoco.mj_ray(model, data, eye, -normal, None, 1, -1, geom) == pytest.approx(2, abs=1e-4)
                assert geom[0] == 2 * number + which


def test_tangents_are_the_directions_of_a_left_handed_basis() -> None:
    normals = np.random.default_rng(5).normal(size=(200, 3))
    normals[0], normals[1] = (0, -1, 0), (0, 0, 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    red, green = tangents(normals)
    np.testing.assert_allclose(np.cross(green, red), normals, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(red, axis=1), 1, atol=1e-9)


SCRAP = (
    '<mesh name="{name}" vertex="0 0 0  2 0 0  2 0.3 1  0 0.3 1  0.2 0.4 2" {uvs} face="0 1 2  0 2 3  3 2 4" '
    'inertia="shell"/>'
)
UVS = 'texcoord="0 1  1 1  1 0.5  0 0.5  0.1 0"'


def small(materials: str, geoms: str, meshes: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        "<mujoco><asset>"
        '<texture name="n" type="2d" builtin="gradient" rgb1="0.6 0.4 1" rgb2="0.4 0.6 1" width="8" height="8"/>'
        '<texture name="c" type="2d" builtin="flat" rgb1="0.6 0.4 1" width="4" height="4"/>'
        f"{materials}{meshes}</asset><worldbody>{geoms}</worldbody></mujoco>"
    )


def worn(roles: str) -> str:
    return f'<material name="m" metallic="0" roughness="1">{roles}</material>'


RELIEF = worn('<layer role="rgb" texture="c"/><layer role="normal" texture="n"/>')


@pytest.mark.parametrize(
    "model",
    [
        small("", '<geom type="box" size="1 1 1" rgba="0.5 0.4 0.3 1"/>'),
        small("", '<geom type="mesh" mesh="a" contype="0" conaffinity="0"/>', SCRAP.format(name="a", uvs=UVS)),
        small(
            worn('<layer role="rgb" texture="c"/>'),
            '<geom type="mesh" mesh="a" material="m" contype="0" conaffinity="0"/>',
            SCRAP.format(name="a", uvs=UVS),
        ),
        small(RELIEF, '<geom type="box" size="1 1 1" material="m"/>'),
        small(
            RELIEF,
            '<geom type="mesh" mesh="a" material="m" contype="0" conaffinity="0"/>',
            SCRAP.format(name="a", uvs=""),
        ),
    ],
    ids=["nothing", "no material", "no normal map", "a primitive", "no texture coordinates"],
)
def test_what_has_no_relief_stays_as_it_is(model: mujoco.MjModel) -> None:
    kept = [getattr(model, name).copy() for name in ("tex_data", "mesh_vert", "mesh_quat", "geom_quat")]
    align_normal_maps(model)
    for name, values in zip(("tex_data", "mesh_vert", "mesh_quat", "geom_quat"), kept, strict=True):
        np.testing.assert_array_equal(getattr(model, name), values)


@pytest.mark.parametrize("is_colour_too", [False, True])
def test_a_picture_that_is_colour_too_keeps_its_channels(is_colour_too: bool) -> None:
    colour = "n" if is_colour_too else "c"
    model = small(
        worn(f'<layer role="rgb" texture="{colour}"/><layer role="normal" texture="n"/>'),
        '<geom type="mesh" mesh="a" material="m" contype="0" conaffinity="0"/>',
        SCRAP.format(name="a", uvs=UVS),
    )
    before = model.tex_data.reshape(-1, 3).copy()
    align_normal_maps(model)
    after = model.tex_data.reshape(-1, 3)
    size = model.tex_width[0] * model.tex_height[0]
    np.testing.assert_array_equal(after[:size], before[:size] if is_colour_too else before[:size, [1, 0, 2]])
    np.testing.assert_array_equal(after[size:], before[size:])


def test_bodies_of_one_mesh_and_shared_meshes_do_not_move() -> None:
    model = small(
        RELIEF + '<material name="plain" rgba="0.5 0.5 0.5 1"/>',
        '<body mocap="true" pos="1 2 3" quat="0.6 0 0.8 0"><geom type="mesh" mesh="a" material="m" contype="0" '
        'conaffinity="0"/></body><body pos="4 0 1"><geom type="mesh" mesh="a" material="plain" contype="0" '
        'conaffinity="0" quat="0.8 0.6 0 0"/></body>',
        SCRAP.format(name="a", uvs=UVS),
    )
    before = corners(model)
    align_normal_maps(model)
    np.testing.assert_allclose(corners(model), before, atol=1e-6)
    for geom in range(model.ngeom):
        np.testing.assert_allclose(
            model.geom_aabb[geom, :3] - model.geom_aabb[geom, 3:], model.mesh_vert.min(axis=0), atol=1e-6
        )
        np.testing.assert_allclose(
            model.geom_aabb[geom, :3] + model.geom_aabb[geom, 3:], model.mesh_vert.max(axis=0), atol=1e-6
        )
        assert (model.geom_size[geom] >= np.abs(model.mesh_vert).max(axis=0) - 1e-6).all()
