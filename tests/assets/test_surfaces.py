"""The billboard: its size, its frame, and a texture that appears the right way round."""

from __future__ import annotations

from pathlib import Path

import cv2
import mujoco
import numpy as np
import numpy.typing as npt
import pytest

from authoring.surfaces.billboard import write_billboard
from authoring.surfaces.face import FACE_SIZE_PX
from gear.world.compilation.quiet_mjcf import mjcf

SURFACES = Path(__file__).parents[2] / "mjcf" / "surfaces"
BILLBOARD = SURFACES / "billboard.xml"
WIDTH_M, HEIGHT_M = 7.4, 3.7
CORNERS = {
    "top_left": (220, 30, 30),
    "top_right": (30, 200, 30),
    "bottom_right": (30, 30, 220),
    "bottom_left": (220, 220, 30),
}


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(BILLBOARD))


def _face_vertices(model: mujoco.MjModel) -> npt.NDArray[np.float64]:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom = model.geom("face").id
    mesh = model.geom_dataid[geom]
    first = model.mesh_vertadr[mesh]
    vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]]
    world = vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    return np.asarray(world, dtype=np.float64)


def test_face_has_the_size_of_its_patch_and_faces_plus_x(model: mujoco.MjModel) -> None:
    vertices = _face_vertices(model)
    assert np.ptp(vertices, axis=0) == pytest.approx([0.0, WIDTH_M, HEIGHT_M], abs=1e-6)
    assert (vertices.min(0) + vertices.max(0)) / 2 == pytest.approx([0.0, 0.0, 2.6], abs=1e-6)


def test_surface_site_is_right_down_into_the_board(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    file_from_surface = data.site("surface").xmat.reshape(3, 3)
    assert file_from_surface == pytest.approx(np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]]), abs=1e-9)
    assert data.site("surface").xpos == pytest.approx([0.0, 0.0, 2.6])


def test_face_alone_uses_its_material_and_texture(model: mujoco.MjModel) -> None:
    face = model.geom("face")
    assert np.sum(model.geom_matid == face.matid[0]) == 1
    texture = model.mat_texid[face.matid[0]]
    assert np.sum(texture >= 0) == 1
    assert np.sum(model.mat_texid == texture.max()) == 1


def test_every_visible_geom_has_a_known_label_and_collisions_are_hidden() -> None:
    spec = mujoco.MjSpec.from_file(str(BILLBOARD))
    for geom in spec.geoms:
        if geom.classname.name == "collision":
            assert geom.group == 3
            assert geom.contype and geom.conaffinity
        else:
            assert geom.classname.name.split(".")[0] in {"pole", "billboard"}
            assert geom.group < 3
            assert geom.contype == geom.conaffinity == 0


def test_structure_stands_on_the_ground(model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    lowest = min(
        float((model.mesh_vert[a : a + n] @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g])[:, 2].min())
        for g in range(model.ngeom)
        if (m := model.geom_dataid[g]) >= 0
        for a, n in [(model.mesh_vertadr[m], model.mesh_vertnum[m])]
    )
    assert lowest == pytest.approx(0.0, abs=2e-3)


def _corner_card() -> npt.NDArray[np.uint8]:
    width, height = FACE_SIZE_PX
    card = np.full((height, width, 3), 128, dtype=np.uint8)
    half_w, half_h = width // 2, height // 2
    card[:half_h, :half_w] = CORNERS["top_left"]
    card[:half_h, half_w:] = CORNERS["top_right"]
    card[half_h:, half_w:] = CORNERS["bottom_right"]
    card[half_h:, :half_w] = CORNERS["bottom_left"]
    return card


def test_texture_reads_left_to_right_and_top_to_bottom() -> None:
    spec = mujoco.MjSpec.from_file(str(BILLBOARD))
    spec.texture("face").file = ""
    spec.texture("face").width, spec.texture("face").height = FACE_SIZE_PX
    spec.texture("face").nchannel = 3
    spec.texture("face").data = _corner_card().tobytes()
    spec.material("face").emission = 1.0
    spec.visual.headlight.ambient = [0.0, 0.0, 0.0]
    spec.visual.headlight.diffuse = [0.0, 0.0, 0.0]
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (0.0, 0.0, 2.6)
    camera.distance, camera.azimuth, camera.elevation = 9.0, 180.0, 0.0
    with mujoco.Renderer(model, 120, 240) as renderer:
        renderer.update_scene(data, camera)
        picture = renderer.render()
    seen = {
        "top_left": picture[45, 80],
        "top_right": picture[45, 160],
        "bottom_right": picture[75, 160],
        "bottom_left": picture[75, 80],
    }
    for corner, colour in CORNERS.items():
        distances = {name: np.abs(seen[corner].astype(float) - other).sum() for name, other in CORNERS.items()}
        nearest = min(distances, key=lambda name: float(distances[name]))
        assert nearest == corner, f"{corner} shows {seen[corner]}, expected {colour}"


def test_loads_in_dm_control() -> None:
    root = mjcf.from_path(str(BILLBOARD))
    assert root.find("geom", "face") is not None
    mujoco.MjModel.from_xml_string(root.to_xml_string(), root.get_assets())


def test_authoring_gives_the_committed_files(tmp_path: Path) -> None:
    write_billboard(tmp_path)
    made = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file())
    assert made == sorted(path.relative_to(SURFACES) for path in SURFACES.rglob("*") if path.is_file())
    for path in made:
        if path.suffix == ".png":  # the encoder's bytes belong to its zlib, the pixels to us
            assert np.array_equal(cv2.imread(str(tmp_path / path)), cv2.imread(str(SURFACES / path)))
        else:
            assert (tmp_path / path).read_bytes() == (SURFACES / path).read_bytes(), path
