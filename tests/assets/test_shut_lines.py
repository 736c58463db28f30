"""Shut lines of vehicles are grooves: as deep as they say, closed, dark at the bottom, and seen without any colour."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from authoring.mesh import Mesh, grid
from authoring.vehicles.car import CarSpec
from authoring.vehicles.cars import ESTATE, SALOON, SPORTS
from authoring.vehicles.grooves import DEPTH_M, HALF_WIDTH_M, carve
from authoring.vehicles.hatchbacks import CITY, HATCHBACK, SUV
from authoring.vehicles.patches import Patch
from authoring.vehicles.sheet import lattice
from authoring.vehicles.thin import thin
from authoring.vehicles.vans import PICKUP, POLICE, TAXI, VAN

VEHICLES = Path(__file__).parents[2] / "mjcf" / "vehicles"
SHADE = np.array([[0.25, 0.5], [0.75, 0.5]])
SPECS = (SALOON, ESTATE, SPORTS, HATCHBACK, CITY, SUV, PICKUP, POLICE, TAXI, VAN)

Floats = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def plate() -> Mesh:
    """A square metre that looks up, of 7 x 7 cells that no line below runs along."""
    line = np.linspace(-0.5, 0.5, 8)
    x, y = np.meshgrid(line, line, indexing="ij")
    sheet = grid(np.stack([x, y, np.zeros_like(x)], axis=-1))
    up = np.tile([0.0, 0.0, 1.0], (len(sheet.vertices), 1))
    faces = sheet.faces if _normals(sheet)[0, 2] > 0 else sheet.faces[:, ::-1]
    return Mesh(sheet.vertices, faces, np.full((len(up), 2), 0.9), up)


@pytest.fixture(scope="module")
def carved(plate: Mesh) -> Mesh:
    """With a line across that bends, mirrored at y = 0, and a ring."""
    ring = ((-0.4, 0.31), (-0.2, 0.31), (-0.2, 0.44), (-0.4, 0.44), (-0.4, 0.31))
    return carve(plate, {"top": (((-0.45, 0.11), (0.07, 0.13), (0.37, 0.3)), ring)}, SHADE)


def _normals(mesh: Mesh) -> Floats:
    corners = mesh.vertices[mesh.faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def test_a_groove_is_as_deep_and_wide_as_it_says(carved: Mesh) -> None:
    used = carved.vertices[np.unique(carved.faces)]
    assert used[:, 2].min() == pytest.approx(-DEPTH_M)
    assert used[:, 2].max() == pytest.approx(0.0, abs=1e-9)
    # Half-way along the straight first part, the bottom and its lips.
    for side in (1, -1):
        part = used[(np.abs(used[:, 0] + 0.2) < 0.15) & (np.abs(side * used[:, 1] - 0.12) < 0.02)]
        across = side * part[:, 1] - (0.11 + (part[:, 0] + 0.45) * 0.02 / 0.52)
        assert np.abs(across[part[:, 2] < -0.9 * DEPTH_M]).max() < 1e-4
        lips = np.abs(across[part[:, 2] > -1e-9])
        assert (np.abs(lips - HALF_WIDTH_M) < 2e-5).sum() >= 4


def test_a_groove_opens_nothing(plate: Mesh, carved: Mesh) -> None:
    _, place = np.unique(np.rint(carved.vertices * 1e5 + 0.25).astype(np.int64), axis=0, return_inverse=True)
    faces = place.reshape(-1)[carved.faces]
    half = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    count = np.unique(half, axis=0, return_counts=True)[1]
    assert count.max() == 2
    assert (count == 1).sum() == 28, "the rim of the plate, as it was"
    assert np.abs(_normals(carved)[:, 2]).sum() == pytest.approx(np.abs(_normals(plate)[:, 2]).sum())
    assert (_normals(carved)[:, 2] > 0).all()


def test_walls_lean_to_the_bottom_and_are_dark_there(carved: Mesh) -> None:
    assert carved.normals is not None
    corners, normals, uvs = (a[carved.faces] for a in (carved.vertices, carved.normals, carved.uvs))
    wall = (corners[:, :, 2] < -0.5 * DEPTH_M).any(axis=1)
    bottom = corners[wall][:, :, 2] < -0.99 * DEPTH_M
    flat = _normals(carved)[wall]
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    agree = np.einsum("nkd,nd->nk", normals[wall], flat)
    assert (agree > 0.5).all(), "shading normals look the way their faces do"
    assert normals[wall][bottom][:, 2].max() < 0.7
    assert np.allclose(uvs[wall][bottom], SHADE[1])
    assert np.allclose(uvs[wall][corners[wall][:, :, 2] > -1e-9], SHADE[0])


def _model(name: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(VEHICLES / f"{name}.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def _sunken(model: mujoco.MjModel, data: mujoco.MjData, view: str, at: Floats, across: Floats) -> float:
    """How much deeper the paint lies at a place than beside it, metres; NaN where something else is seen there."""
    depths = []
    for place in (at, at - 2.5 * HALF_WIDTH_M * across, at + 2.5 * HALF_WIDTH_M * across):
        if view == "top":
            eye, along = np.array([*place, 4.0]), np.array([0.0, 0.0, -1.0])
        else:
            eye, along = np.array([place[0], 4.0, place[1]]), np.array([0.0, -1.0, 0.0])
        geom = np.zeros(1, np.int32)
        depth = mujoco.mj_ray(model, data, eye, along, np.array([1, 1, 1, 0, 0, 0], np.uint8), 1, -1, geom)
        if depth < 0 or model.mesh(model.geom_dataid[geom[0]]).name != "paint":
            return float("nan")
        depths.append(depth)
    return float(depths[0] - (depths[1] + depths[2]) / 2)


def _along(line: tuple[tuple[float, float], ...]) -> list[tuple[Floats, Floats]]:
    """Places every centimetre on a line, away from its corners, and the directions across."""
    places = []
    points = np.array(line)
    for a, b in pairwise(points):
        length = float(np.linalg.norm(b - a))
        unit = (b - a) / length
        for step in np.arange(0.02, length - 0.02, 0.01):
            places.append((a + step * unit, np.array([-unit[1], unit[0]])))
    return places


@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.name)
@pytest.mark.parametrize("what", ["bonnet", "door"])
def test_bonnets_and_doors_have_gaps_of_some_millimetres_all_along(spec: CarSpec, what: str) -> None:
    model, data = _model(spec.name)
    lines = spec.lines_top[:1] if what == "bonnet" else spec.lines_side[:2]
    view = "top" if what == "bonnet" else "side"
    sunken = np.array([_sunken(model, data, view, *place) for line in lines for place in _along(line)])
    on_paint = sunken[np.isfinite(sunken)]
    assert len(on_paint) > (60 if what == "bonnet" else 40)
    assert np.median(on_paint) == pytest.approx(DEPTH_M, abs=0.002)
    assert (on_paint > 0.003).mean() > 0.85


@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.name)
def test_bonnets_are_closed_all_round(spec: CarSpec) -> None:
    line = np.array(spec.lines_top[0])
    assert line[0, 1] == line[-1, 1] == 0.0, "it begins and ends in the middle, where the other half's begins"
    assert line[0, 0] - line[-1, 0] < -0.4
    model, data = _model(spec.name)
    middle = [place for place in _along(spec.lines_top[0]) if place[0][1] < 0.35]
    sunken = np.array([_sunken(model, data, "top", *place) for place in middle])
    assert np.isfinite(sunken).sum() > 10
    assert np.nanmedian(sunken) > 0.003, "it is there in the middle, too"


@pytest.mark.parametrize("sun", [(0.9, -0.3, -0.3), (-0.9, -0.3, -0.3)], ids=["from_behind", "from_ahead"])
def test_a_door_line_is_seen_on_uniform_paint(sun: tuple[float, float, float]) -> None:
    """Raking light, and nothing but the shape to tell the line by."""
    spec = mujoco.MjSpec.from_file(str(VEHICLES / "car_saloon.xml"))
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
        material.rgba[:3] = 0.7
    spec.worldbody.add_light(dir=sun, pos=[0, 20, 6], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, castshadow=False)
    spec.visual.headlight.ambient[:] = 0.2
    spec.visual.headlight.diffuse[:] = spec.visual.headlight.specular[:] = 0
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = (-0.02, 0.9, 0.45), 0.5, -90.0, 0.0
    with mujoco.Renderer(model, 120, 320) as renderer:
        renderer.update_scene(data, camera)
        seen = renderer.render().astype(float).mean(axis=2)
    row = seen[50:70].mean(axis=0)
    away = np.abs(np.arange(320) - 159.5)
    beside = row[(away > 25) & (away < 60)]
    line = row[away < 12]
    assert np.ptp(beside) < 20
    assert np.abs(line - beside.mean()).max() > 40


def _dome(radius_m: float) -> Patch:
    def evaluate(params: Floats) -> Floats:
        x, y = params[:, 0] - 0.5, params[:, 1] - 0.5
        return np.column_stack([x, y, np.sqrt(radius_m**2 - x**2 - y**2) - radius_m])

    return Patch(evaluate, 1.0)


@pytest.mark.parametrize("radius_m", [1000.0, 2.0])
def test_thinning_keeps_shape_rim_and_outlines(radius_m: float) -> None:
    line = np.linspace(0, 1, 25)
    sheet = lattice(_dome(radius_m), line, line, "paint")
    sheet.stamp(lambda p, q: np.abs(p[:, 0] - 0.11) - 0.2, "glass")
    before = len(sheet.faces)
    areas = {name: sheet.part(name).face_areas().sum() for name in ("paint", "glass")}
    rim = {tuple(p) for p in sheet.params.tolist() if min(p) == 0 or max(p) == 1}
    thin(sheet)
    assert len(sheet.faces) < (0.35 if radius_m > 100 else 0.7) * before
    assert {tuple(p) for p in sheet.params.tolist() if min(p) == 0 or max(p) == 1} == rim
    for name, area in areas.items():
        assert sheet.part(name).face_areas().sum() == pytest.approx(area, rel=2e-3)
    middle = sheet.params[sheet.faces].mean(axis=1)
    assert np.abs(sheet.patch.evaluate(middle) - sheet.points[sheet.faces].mean(axis=1)).max() < 0.0025
