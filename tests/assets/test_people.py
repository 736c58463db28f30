"""People and two-wheelers: they load, have human sizes, stand on the ground, keep budgets and look like somebody."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import cv2
import mujoco
import numpy as np
import numpy.typing as npt
import pytest
import trimesh
from dm_control import mjcf

from authoring.people.decimate import decimate
from authoring.people.export import write_person, write_textures
from authoring.people.field import Frame, blend, capsule, loft
from authoring.people.polygonise import polygonise
from authoring.people.wardrobe import PEOPLE
from authoring.two_wheelers.catalogue import two_wheelers
from authoring.two_wheelers.export import write_two_wheeler
from gear.world.assets.library import read_actor_facts

MJCF = Path(__file__).parents[2] / "mjcf"
PEDESTRIANS = sorted((MJCF / "pedestrians").glob("*.xml"))
RIDDEN = sorted([*(MJCF / "vehicles").glob("motorcycle_*.xml"), *(MJCF / "vehicles").glob("bicycle_*.xml")])
HEIGHT_M = {person.name: person.build.height_m for person in PEOPLE}


def _ids(path: Path) -> str:
    return path.stem


@cache
def _model(path: Path) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def _vertices(path: Path, geoms: list[str] | None = None) -> npt.NDArray[np.float64]:
    model, data = _model(path)
    parts = []
    for geom in range(model.ngeom):
        mesh = model.geom_dataid[geom]
        if mesh >= 0 and (geoms is None or model.geom(geom).name in geoms):
            first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            local = model.mesh_vert[first : first + count]
            parts.append(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return np.concatenate(parts)


def _text(path: Path, name: str) -> str:
    model, _ = _model(path)
    text = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, name)
    first, size = model.text_adr[text], model.text_size[text]
    return bytes(model.text_data[first : first + size - 1]).decode()


def _classes(path: Path) -> dict[str, int]:
    spec = mujoco.MjSpec.from_file(str(path))
    return {geom.classname.name: geom.group for geom in spec.geoms}


def test_there_are_enough_different_people_in_gait() -> None:
    people = {_text(path, "actor.person") for path in PEDESTRIANS}
    assert people == set(HEIGHT_M)
    assert len(people) >= 10
    for name in people:
        poses = [_text(path, "actor.pose") for path in PEDESTRIANS if _text(path, "actor.person") == name]
        assert poses.count("walk") >= 2, name
        assert poses.count("stand") >= 1, name


@pytest.mark.parametrize("path", PEDESTRIANS, ids=_ids)
def test_person_is_of_human_size_and_on_the_ground(path: Path) -> None:
    height = HEIGHT_M[_text(path, "actor.person")]
    low, high = _vertices(path).min(axis=0), _vertices(path).max(axis=0)
    assert low[2] == pytest.approx(0.0, abs=2e-3)
    assert 0.90 * height < high[2] < 1.09 * height  # a stride is lower, hair and hats are higher
    assert 0.3 < high[1] - low[1] < 0.95
    assert high[0] - low[0] < 0.95 * height
    assert np.abs(low + high)[:2].max() < 0.5


@pytest.mark.parametrize("path", PEDESTRIANS, ids=_ids)
def test_person_faces_plus_x(path: Path) -> None:
    """Shoes reach further forward than back of the ankles; a mirrored or turned person fails."""
    if _text(path, "actor.pose") == "stand":
        shoes = _vertices(path, ["shoes"])
        ankles = shoes[shoes[:, 2] > 0.8 * shoes[:, 2].max()].mean(axis=0)
        assert shoes[:, 0].max() - ankles[0] > ankles[0] - shoes[:, 0].min()
    else:
        assert _text(path, "actor.pose") == "walk"


def test_strides_are_each_others_opposite() -> None:
    for name in HEIGHT_M:
        leads = []
        for pose in ("walk_a", "walk_b"):
            shoes = _vertices(MJCF / "pedestrians" / f"{name}_{pose}.xml", ["shoes"])
            leads.append(shoes[shoes[:, 1] > 0, 0].mean() - shoes[shoes[:, 1] < 0, 0].mean())
        assert leads[0] > 0.1 * HEIGHT_M[name] > -0.1 * HEIGHT_M[name] > leads[1], name


@pytest.mark.parametrize("path", PEDESTRIANS, ids=_ids)
def test_person_keeps_budget_labels_and_palette(path: Path) -> None:
    model, _ = _model(path)
    classes = _classes(path)
    assert all(name == "collision" or name.startswith("person.") for name in classes)
    assert {"person.paint", "person.skin", "person.shoes", "collision"} <= set(classes)
    assert all((group == 3) == (name == "collision") for name, group in classes.items())
    assert model.ngeom - 1 <= 6
    assert model.nmeshface <= 4000
    assert _text(path, "actor.kind") == "person"
    palette = model.numeric("paint.palette").data.reshape(-1, 4)
    assert np.all((palette[:, :3] > 0.0) & (palette[:, :3] < 0.8))
    assert np.all(palette[:, 3] > 0.0)


COCO = (
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle",
)  # fmt: skip
WITHIN_M, IN_A_COAT_M = 0.1, 0.15
"""Largest distance of a joint from the nearest vertex of clothes or skin; the second is for hips and knees."""


@pytest.mark.parametrize("path", [*PEDESTRIANS, *RIDDEN], ids=_ids)
def test_person_has_the_key_points_of_coco(path: Path) -> None:
    """In COCO's order, inside the body, left of the right ones, and the head over the hips over the feet."""
    points = {name: np.array(point) for name, point in read_actor_facts(path).key_points}
    assert tuple(points) == COCO
    names = None if path in PEDESTRIANS else ["rider_jacket", "rider_cloth", "rider_skin"]
    vertices = _vertices(path, names)
    for name, point in points.items():
        assert np.linalg.norm(vertices - point, axis=1).min() < (
            IN_A_COAT_M if name.endswith(("hip", "knee")) else WITHIN_M
        ), name
    for name in ("eye", "ear", "shoulder", "hip"):
        assert points[f"left_{name}"][1] > points[f"right_{name}"][1], name
    assert points["nose"][0] > points["left_ear"][0], "the face looks along +x"
    knees, ankles, hips = (min(points[f"{s}_{n}"][2] for s in ("left", "right")) for n in ("knee", "ankle", "hip"))
    assert points["nose"][2] > points["left_shoulder"][2] > hips > knees > ankles > 0.02


@pytest.mark.parametrize("path", RIDDEN, ids=_ids)
def test_two_wheeler_has_its_rider_and_touches_the_ground(path: Path) -> None:
    model, _ = _model(path)
    kind = path.stem.split("_")[0]
    labels = {name.split(".")[0] for name in _classes(path)}
    assert labels == {kind, "rider", "collision"}
    assert _text(path, "actor.kind") == kind
    assert any(name.endswith(".paint") for name in _classes(path))
    everything, tyres = _vertices(path), _vertices(path, ["trim"])
    assert everything[:, 2].min() == pytest.approx(tyres[:, 2].min(), abs=1e-6) == pytest.approx(0.0, abs=2e-3)
    assert 1.6 < np.ptp(everything[:, 0]) < 2.3
    assert 1.4 < everything[:, 2].max() < 1.9
    assert np.abs(everything[:, 0].min() + everything[:, 0].max()) < 0.02
    ground = tyres[tyres[:, 2] < 0.01, 0]
    assert ground.min() < -0.4 < 0.4 < ground.max()  # both wheels stand
    machine = sum(model.mesh_facenum[model.geom(name).dataid[0]] for name in ("paint", "metal", "trim"))
    assert machine <= 12000
    assert model.nmeshface - machine <= 4200
    assert model.ngeom - 2 <= 10


@pytest.mark.parametrize("path", [*PEDESTRIANS[::9], *RIDDEN], ids=_ids)
def test_loads_in_dm_control(path: Path) -> None:
    root = mjcf.from_path(str(path))
    mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def _portrait(path: Path) -> npt.NDArray[np.float64]:
    """(480, 320, 3) in 0..255, from the front, flat light: what is seen is albedo."""
    spec = mujoco.MjSpec.from_file(str(path))
    spec.visual.headlight.ambient = [0.9, 0.9, 0.9]
    spec.visual.headlight.diffuse = [0.1, 0.1, 0.1]
    spec.visual.headlight.specular = [0.0, 0.0, 0.0]
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (0.0, 0.0, 0.9)
    camera.distance, camera.azimuth, camera.elevation = 2.6, 180.0, 0.0
    with mujoco.Renderer(model, 480, 320) as renderer:
        renderer.update_scene(data, camera)
        return np.asarray(renderer.render(), dtype=np.float64)


def _looks_like_a_man_in_a_red_shirt(picture: npt.NDArray[np.float64]) -> bool:
    rows, columns = np.nonzero(picture.sum(axis=2) > 4)
    top, bottom, middle = rows.min(), rows.max(), int(np.median(columns))

    def band(start: float, end: float) -> npt.NDArray[np.float64]:
        tall = bottom - top
        part = picture[top + round(start * tall) : top + round(end * tall), middle - 8 : middle + 8]
        return np.asarray(np.median(part.reshape(-1, 3), axis=0))

    hair, face, shirt, shoes = band(0.0, 0.02), band(0.06, 0.10), band(0.22, 0.40), picture[bottom - 6 : bottom]
    fair = face.mean() > 1.8 * hair.mean() and face[0] > face[1] > face[2]
    return bool(fair and shirt[0] > 2.0 * shirt[1] and shoes.max() > 100)


def test_a_portrait_shows_hair_over_a_face_over_a_red_shirt() -> None:
    picture = _portrait(MJCF / "pedestrians" / "man_casual_stand.xml")
    assert _looks_like_a_man_in_a_red_shirt(picture)
    assert not _looks_like_a_man_in_a_red_shirt(picture[::-1])
    assert not _looks_like_a_man_in_a_red_shirt(picture[:, :, ::-1])


def test_polygonised_and_thinned_surfaces_stay_closed_and_true() -> None:
    frame = Frame(np.zeros(3), np.eye(3))
    field = blend(
        [capsule(frame, (0, 0, 0), (0, 0, 0.4), 0.06), capsule(frame, (0, 0, 0.3), (0.3, 0, 0.5), 0.05)], 0.05
    )
    vertices, faces = polygonise(field, np.array([-0.1, -0.1, -0.1]), np.array([0.4, 0.1, 0.6]), 0.012)
    assert np.abs(field(vertices)).max() < 1e-4
    fewer, thin = decimate(vertices, faces, 600)
    assert len(thin) <= 600
    assert np.abs(field(fewer)).max() < 3e-3
    for points, triangles in ((vertices, faces), (fewer, thin)):
        mesh = trimesh.Trimesh(points, triangles, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume > 0.0


def test_a_loft_is_inside_its_stations_and_outside_elsewhere() -> None:
    field = loft(Frame(np.zeros(3), np.eye(3)), [(0.0, 0.0, 0.0, 0.1, 0.2), (1.0, 0.0, 0.0, 0.1, 0.2)], cap=0.05)
    points = np.array([[0.0, 0.0, 0.5], [0.099, 0.0, 0.5], [0.101, 0.0, 0.5], [0.0, 0.199, 0.5], [0.0, 0.0, 1.06]])
    assert list(field(points) < 0.0) == [True, True, False, True, False]


def _same_files(made: Path, kept: Path) -> None:
    for path in sorted(path for path in made.rglob("*") if path.is_file()):
        other = kept / path.relative_to(made)
        if path.suffix == ".png":  # the encoder's bytes belong to its zlib, the pixels to us
            assert np.array_equal(cv2.imread(str(path)), cv2.imread(str(other))), other
        else:
            assert path.read_bytes() == other.read_bytes(), other


def test_authoring_a_person_gives_the_committed_files(tmp_path: Path) -> None:
    person = next(person for person in PEOPLE if person.name == "girl")
    write_textures(tmp_path, person)
    write_person(tmp_path, person, person.poses[1])
    _same_files(tmp_path, MJCF / "pedestrians")


def test_authoring_a_bicycle_gives_the_committed_files(tmp_path: Path) -> None:
    write_two_wheeler(tmp_path, next(machine for machine in two_wheelers() if machine.name == "bicycle_a"))
    _same_files(tmp_path, MJCF / "vehicles")
