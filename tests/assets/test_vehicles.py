"""Vehicles: they load, stand on their wheels, keep their budgets, and the lorry's face is the right way round."""

from __future__ import annotations

from pathlib import Path

import cv2
import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from authoring.vehicles.catalogue import CATALOGUE, write
from authoring.vehicles.trucks import FACE_SIZE_M
from gear.values.labels import LABEL_BY_NAME
from gear.world.compilation.quiet_mjcf import mjcf

VEHICLES = Path(__file__).parents[2] / "mjcf" / "vehicles"
NAMES = sorted(CATALOGUE)
CARS = [name for name in NAMES if name.startswith("car_")]

# Real vehicles of each sort, metres: lowest and highest length, width with mirrors, height.
SIZES = {
    "car_city": ((3.4, 3.8), (1.6, 2.1), (1.4, 1.65)),
    "car_hatchback": ((4.0, 4.5), (1.75, 2.2), (1.4, 1.6)),
    "car_saloon": ((4.5, 5.0), (1.8, 2.3), (1.4, 1.6)),
    "car_estate": ((4.5, 5.0), (1.8, 2.3), (1.4, 1.6)),
    "car_police": ((4.5, 5.0), (1.8, 2.3), (1.5, 1.75)),
    "car_taxi": ((4.5, 5.0), (1.8, 2.3), (1.5, 1.75)),
    "car_suv": ((4.4, 4.9), (1.85, 2.3), (1.6, 1.85)),
    "car_sports": ((4.2, 4.7), (1.8, 2.3), (1.15, 1.35)),
    "car_pickup": ((5.1, 5.6), (1.85, 2.4), (1.7, 1.9)),
    "van_panel": ((5.2, 6.0), (1.95, 2.6), (2.2, 2.6)),
    "van_ambulance": ((5.2, 6.0), (1.95, 2.6), (2.3, 2.7)),
    "bus_city": ((11.8, 12.3), (2.5, 3.2), (3.0, 3.4)),
    "truck_box": ((7.8, 8.3), (2.45, 2.9), (3.3, 3.6)),
    "truck_rigid": ((7.8, 8.3), (2.35, 2.9), (2.4, 2.9)),
}


@pytest.fixture(scope="module", params=NAMES)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def model(name: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(VEHICLES / f"{name}.xml"))


def _in_file_frame(model: mujoco.MjModel, geom: int) -> npt.NDArray[np.float64]:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mesh = model.geom_dataid[geom]
    first = model.mesh_vertadr[mesh]
    vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
    return np.asarray(vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom], dtype=np.float64)


def _visible(model: mujoco.MjModel) -> list[int]:
    return [geom for geom in range(model.ngeom) if model.geom_group[geom] < 3]


def _geom_of(model: mujoco.MjModel, mesh: str) -> int:
    return next(g for g in _visible(model) if model.geom_dataid[g] == model.mesh(mesh).id)


def _panes(model: mujoco.MjModel) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float32]]:
    """Corners of the glass's faces, (N, 3, 3) metres, and their texture coordinates, (N, 3, 2)."""
    geom = _geom_of(model, "glass")
    mesh = model.geom_dataid[geom]
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    uvs = model.mesh_texcoord[model.mesh_texcoordadr[mesh] :]
    return _in_file_frame(model, geom)[model.mesh_face[faces]], uvs[model.mesh_facetexcoord[faces]]


def _inside(name: str) -> npt.NDArray[np.uint8]:
    """The picture of what is seen through a vehicle's panes."""
    spec = mujoco.MjSpec.from_file(str(VEHICLES / f"{name}.xml"))
    picture = cv2.imread(str(VEHICLES / next(texture.file for texture in spec.textures if texture.name == "inside")))
    assert picture is not None
    return np.asarray(picture, dtype=np.uint8)


def test_every_file_has_its_script_and_every_script_its_file() -> None:
    assert sorted(path.stem for path in VEHICLES.glob("car_*.xml")) == CARS
    assert all((VEHICLES / f"{name}.xml").is_file() for name in NAMES)
    assert len(CARS) >= 8


def test_size_is_a_real_vehicles(name: str, model: mujoco.MjModel) -> None:
    points = np.concatenate([_in_file_frame(model, geom) for geom in _visible(model)])
    extent = np.ptp(points, axis=0)
    for length, (low, high) in zip(extent, SIZES[name], strict=True):
        assert low <= length <= high
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    assert middle[:2] == pytest.approx([0, 0], abs=0.12), "the origin is in the middle of the footprint"


def test_stands_on_its_tyres(model: mujoco.MjModel) -> None:
    tyres = _in_file_frame(model, _geom_of(model, "tyre"))
    others = np.concatenate([_in_file_frame(model, g) for g in _visible(model) if g != _geom_of(model, "tyre")])
    assert tyres[:, 2].min() == pytest.approx(0.0, abs=0.002)
    assert others[:, 2].min() > 0.05
    ground = tyres[tyres[:, 2] < 0.03]
    for x_sign in (1, -1):
        for y_sign in (1, -1):
            assert ((ground[:, 0] * x_sign > 0.8) & (ground[:, 1] * y_sign > 0.5)).any(), "a wheel in each corner"


def test_looks_ahead_along_x(model: mujoco.MjModel) -> None:
    points = np.concatenate([_in_file_frame(model, geom) for geom in _visible(model)])
    outermost = points[np.abs(points[:, 1]).argsort()[-20:]]
    assert (outermost[:, 0] > 0.2).all(), "mirrors stand out farthest, and in the front half"


def test_budgets(name: str, model: mujoco.MjModel) -> None:
    assert len(_visible(model)) <= 10
    assert model.nmeshface <= (12_600 if name in CARS else 14_000)
    assert model.ntexdata < 4_000_000


def test_every_visible_geom_has_a_known_label_and_no_collision(name: str) -> None:
    spec = mujoco.MjSpec.from_file(str(VEHICLES / f"{name}.xml"))
    kind = next(text.data for text in spec.texts if text.name == "actor.kind")
    assert kind == name.split("_", 1)[0]
    painted = 0
    for geom in spec.geoms:
        own = geom.classname.name
        if own == "collision":
            assert (geom.group, geom.type) == (3, mujoco.mjtGeom.mjGEOM_BOX)
            continue
        assert own.split(".")[0] == kind
        assert own.split(".")[0] in LABEL_BY_NAME
        assert (geom.group, geom.contype, geom.conaffinity) == (1, 0, 0)
        painted += own.endswith(".paint")
    assert painted == 1


def test_palette_is_physical_albedo(model: mujoco.MjModel) -> None:
    rows = np.asarray(model.numeric("paint.palette").data).reshape(-1, 4)
    assert (rows[:, :3] >= 0.01).all()
    assert (rows[:, :3] <= 0.75).all()
    assert (rows[:, 3] > 0).all()


def test_collision_boxes_cover_the_body(model: mujoco.MjModel) -> None:
    boxes = [g for g in range(model.ngeom) if model.geom_group[g] == 3]
    assert 1 <= len(boxes) <= 2
    low = np.min([model.geom_pos[g] - model.geom_size[g] for g in boxes], axis=0)
    high = np.max([model.geom_pos[g] + model.geom_size[g] for g in boxes], axis=0)
    paint = _in_file_frame(model, _geom_of(model, "paint"))
    assert low[0] - 0.05 <= paint[:, 0].min()
    assert high[0] + 0.05 >= paint[:, 0].max()
    assert high[2] + 0.05 >= paint[:, 2].max()
    assert 0 < low[2] < 0.6
    tyres = _in_file_frame(model, _geom_of(model, "tyre"))
    assert low[1] <= tyres[:, 1].min() + 0.02


def test_meshes_are_sound(model: mujoco.MjModel) -> None:
    for mesh in range(model.nmesh):
        vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
        faces = model.mesh_face[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]
        corners = vertices[faces].astype(np.float64)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        assert (area > 0).all(), "no degenerate faces"
        normals = model.mesh_normal[model.mesh_normaladr[mesh] :][: model.mesh_normalnum[mesh]]
        used = normals[model.mesh_facenormal[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]]
        assert np.abs(np.linalg.norm(used, axis=-1) - 1).max() < 0.01
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / area[:, None]
        agrees = (flat * used.mean(axis=1)).sum(axis=1) > 0
        assert area[agrees].sum() > 0.995 * area.sum(), "shading normals look the way their faces do"


def test_paint_looks_outwards(model: mujoco.MjModel) -> None:
    mesh = model.mesh("paint").id
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
    faces = model.mesh_face[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]
    corners = vertices[faces].astype(np.float64)
    # An outward shell has positive volume about any point: the sum of its tetrahedra to the origin.
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume > 1.0


def test_no_back_of_a_face_is_seen_from_outside(name: str, model: mujoco.MjModel) -> None:
    """Renderers leave out backs and rays do not: a hole or a wrong winding would set depth and picture apart."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rng = np.random.default_rng(7)
    half = np.array([low for low, _ in SIZES[name]]) / 2
    distance, backs, hits = float(half[0]) * 2.6, 0, 0
    geom, normal = np.zeros(1, np.int32), np.zeros(3)
    for azimuth, elevation in zip(rng.uniform(0, 2 * np.pi, 3000), rng.uniform(-0.02, 0.4, 3000), strict=True):
        flat = np.cos(elevation)
        eye = distance * np.array([np.cos(azimuth) * flat, np.sin(azimuth) * flat, np.sin(elevation)]) + [0, 0, 0.3]
        aim = rng.uniform(-half * [1, 1, 0], half * [1, 1, 2])
        along = (aim - eye) / np.linalg.norm(aim - eye)
        groups = np.array([1, 1, 1, 0, 0, 0], np.uint8)
        if mujoco.mj_ray(model, data, eye, along, groups, 1, -1, geom, normal) >= 0:
            hits += 1
            backs += int(normal @ along > 0)
    assert hits > 1000
    assert backs <= 0.002 * hits


def test_panes_show_the_inside_the_right_way_round(model: mujoco.MjModel) -> None:
    corners, uvs = _panes(model)
    right = uvs[..., 0].mean(axis=1)
    ahead = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 0]
    across = corners[:, :, 1].mean(axis=1)
    is_middle = np.abs(across) < 0.3
    screens = [end for end in (is_middle & (ahead > 0), is_middle & (ahead < 0)) if end.any()]
    assert len(screens) >= 1
    for chosen in screens:
        # Who looks at a screen from outside has the vehicle's left on the right before it, and on the left behind it.
        facing = np.sign(ahead[chosen][0])
        assert facing * np.corrcoef(across[chosen], right[chosen])[0, 1] > 0.95


@pytest.mark.parametrize("name", [name for name in NAMES if name != "bus_city"], indirect=True)
@pytest.mark.parametrize("side", [1, -1], ids=["left", "right"])
def test_the_wheel_is_seen_at_the_front_of_either_side(name: str, model: mujoco.MjModel, side: int) -> None:
    corners, uvs = _panes(model)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    is_side = normals[:, 1] * side > 0.8 * np.linalg.norm(normals, axis=1)
    shares = np.random.default_rng(3).dirichlet([1, 1, 1], 400)
    ahead = np.ravel(shares @ corners[is_side, :, 0].T)
    u, v = (np.ravel(shares @ uvs[is_side, :, axis].T) for axis in (0, 1))
    inside = _inside(name)
    high, wide = inside.shape[:2]
    # MuJoCo turns v over as it loads a mesh: it counts down, as the picture's rows do.
    shade = inside[np.minimum(v * high, high - 1).astype(int), np.minimum(u * wide, wide - 1).astype(int)].max(-1)
    front, rear = ahead.max(), ahead.min()
    is_wheel = shade < 13
    assert is_wheel.sum() > 100
    assert (ahead[is_wheel].min() - rear) / (front - rear) > 0.6


def test_every_pane_has_an_inside_of_many_shades(name: str) -> None:
    spec = mujoco.MjSpec.from_file(str(VEHICLES / f"{name}.xml"))
    assert [geom.classname.name.split(".")[1] for geom in spec.geoms if geom.material == "glass"] == ["glass"]
    inside = _inside(name)
    assert inside.mean() < 90, "darker than the street"
    assert inside.std() > 15, "not one dark sheet"


def test_composes_under_dm_control_twice_over(name: str, model: mujoco.MjModel) -> None:
    town = mjcf.RootElement(model="town")
    for copy in ("first", "second"):
        vehicle = mjcf.from_path(str(VEHICLES / f"{name}.xml"))
        vehicle.model = copy
        town.worldbody.add("site", pos=[0, 5, 0] if copy == "second" else [0, 0, 0]).attach(vehicle)
    both = mujoco.MjModel.from_xml_string(town.to_xml_string(), town.get_assets())
    assert both.ngeom == 2 * model.ngeom
    assert both.nmeshface == 2 * model.nmeshface


def test_lorry_face_looks_backwards_right_and_down_as_its_viewer_sees_them() -> None:
    model = mujoco.MjModel.from_xml_path(str(VEHICLES / "truck_box.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    site = data.site("surface")
    file_from_surface = site.xmat.reshape(3, 3)
    assert file_from_surface == pytest.approx(np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]), abs=1e-9)
    face = _in_file_frame(model, model.geom("face").id)
    in_surface = (face - site.xpos) @ file_from_surface
    assert np.ptp(in_surface, axis=0) == pytest.approx([*FACE_SIZE_M, 0], abs=1e-6)
    assert in_surface.mean(axis=0) == pytest.approx([0, 0, 0], abs=1e-6)
    others = np.concatenate([_in_file_frame(model, g) for g in _visible(model) if g != model.geom("face").id])
    before = (others - site.xpos) @ file_from_surface
    covering = (np.abs(before[:, :2]) < np.array(FACE_SIZE_M) / 2).all(axis=1) & (before[:, 2] < 0.005)
    assert not covering.any(), "nothing stands before the face"
    assert FACE_SIZE_M[0] >= 2.2
    assert FACE_SIZE_M[0] / FACE_SIZE_M[1] == pytest.approx(2.0)


def test_lorry_face_shows_its_picture_the_right_way_round() -> None:
    corners = {"top_left": (220, 30, 30), "top_right": (30, 200, 30), "bottom_right": (30, 30, 220)}
    picture = np.full((256, 512, 3), 128, dtype=np.uint8)
    picture[:128, :256], picture[:128, 256:], picture[128:, 256:] = corners.values()
    spec = mujoco.MjSpec.from_file(str(VEHICLES / "truck_box.xml"))
    spec.worldbody.add_light(dir=[1, 0, -0.3], pos=[-20, 0, 6], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    model = spec.compile()
    texture = model.texture("face").id
    at, size = model.tex_adr[texture], picture.size
    assert model.tex_width[texture] * model.tex_height[texture] * model.tex_nchannel[texture] == size
    model.tex_data[at : at + size] = picture.reshape(-1)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = data.site("surface").xpos, 2.2, 0.0, 0.0
    with mujoco.Renderer(model, 240, 320) as renderer:
        renderer.update_scene(data, camera)
        seen = renderer.render().astype(int)
    places = {"top_left": seen[100, 120], "top_right": seen[100, 200], "bottom_right": seen[140, 200]}
    for corner, wanted in corners.items():
        assert int(places[corner].argmax()) == int(np.argmax(wanted)), f"{corner} shows {places[corner]}"


def _plates(
    name: str, part: str = "plate", below: float = -1.0
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Corners of the faces of a part that lie below a v: (K, 3, 3) places, (K, 3, 2) u and v."""
    model = mujoco.MjModel.from_xml_path(str(VEHICLES / f"{name}.xml"))
    mesh = model.mesh(part).id
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    uvs = model.mesh_texcoord[model.mesh_texcoordadr[mesh] :][model.mesh_facetexcoord[faces]].astype(np.float64)
    shown = (uvs[:, :, 1] > below).all(axis=1)
    return _in_file_frame(model, _geom_of(model, part))[model.mesh_face[faces][shown]], uvs[shown]


def test_every_vehicle_has_a_plate_of_its_own_in_front_and_behind() -> None:
    sheet = cv2.imread(str(VEHICLES / "common" / "plates.png"), cv2.IMREAD_GRAYSCALE)
    assert sheet is not None
    pictures: dict[bytes, str] = {}
    for name in NAMES:
        corners, uvs = _plates(name)
        ahead = corners[:, :, 0].mean(axis=1) > 0
        assert (ahead.sum(), (~ahead).sum()) == (2, 2), f"{name}: a rectangle at each end"
        low, high = uvs[ahead].min(axis=(0, 1)), uvs[ahead].max(axis=(0, 1))
        assert np.array_equal(low, uvs[~ahead].min(axis=(0, 1))), f"{name}: front and rear say the same"
        assert np.array_equal(high, uvs[~ahead].max(axis=(0, 1)))
        for end, right in ((ahead, 1.0), (~ahead, -1.0)):
            across, up = corners[end][:, :, 1] * right, corners[end][:, :, 2]
            assert np.array_equal(uvs[end][:, :, 0] == high[0], across > across.mean()), f"{name}: reads to the right"
            assert np.array_equal(uvs[end][:, :, 1] == low[1], up > up.mean()), f"{name}: stands upright"
        left, top, right_px, bottom = np.rint(np.concatenate([low, high]) * np.tile(sheet.shape[::-1], 2)).astype(int)
        picture = sheet[top:bottom, left:right_px]
        ink = picture[8:-8, picture.shape[1] // 8 : -8] < 80
        assert 0.15 < ink.mean() < 0.5, f"{name}: the plate says something"
        assert (picture > 200).mean() > 0.3
        assert picture.tobytes() not in pictures, f"{name} has the plate of {pictures[picture.tobytes()]}"
        pictures[picture.tobytes()] = name


def test_instances_of_a_vehicle_have_six_plates_by_turns(model: mujoco.MjModel) -> None:
    shown = set()
    for part in ["plate", *(f"plate_{k}" for k in range(1, 6))]:
        mesh = model.mesh(part).id
        faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
        uvs = model.mesh_texcoord[model.mesh_texcoordadr[mesh] :][model.mesh_facetexcoord[faces]].reshape(-1, 2)
        assert np.ptp(uvs, axis=0) == pytest.approx([162 / 512, 34 / 512], abs=1e-4), "one plate, less its margin"
        shown.add(tuple(np.floor(uvs.mean(axis=0) * 512 / [170, 42]).astype(int).tolist()))
    assert len(shown) == 6


def test_motorcycles_have_plates_of_their_own() -> None:
    lower: list[bytes] = []
    for name in ("motorcycle_a", "motorcycle_b"):
        corners, uvs = _plates(name, "trim", 0.5)
        assert len(uvs) == 2
        assert (corners[:, :, 0] < -0.5).all(), "behind"
        assert np.array_equal(uvs[:, :, 0] > 0.5, corners[:, :, 1] < 0), "reads to the right"
        image = cv2.imread(str(VEHICLES / name / "machine.png"), cv2.IMREAD_GRAYSCALE)
        assert image is not None
        picture = image[image.shape[0] // 2 :]
        assert 0.1 < (picture < 80).mean() < 0.5
        lower.append(picture.tobytes())
    assert lower[0] != lower[1]


def test_scripts_make_the_committed_files(tmp_path: Path) -> None:
    write(tmp_path, ["truck_box", "car_city"])
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(files) > 18
    for made in files:
        kept = VEHICLES / made.relative_to(tmp_path)
        if made.suffix == ".png":
            # Another release of zlib may pack the same pixels otherwise.
            assert np.array_equal(cv2.imread(str(made)), cv2.imread(str(kept))), made.name
        else:
            assert made.read_bytes() == kept.read_bytes(), made.name
