"""What authors write of their meshes, and what MuJoCo reads of it."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from authoring.kit.parts import Sink
from authoring.mesh import Mesh, box, merge, rotation, write_obj
from authoring.towns.chunks import PITCHED, SIDES, chunked

TRIANGLES = [[0, 1, 2], [0, 2, 3]]
SLOPED = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.5, 1.0, 0.0], [0.5, 1.0, 0.0]]


def faces_of(path: Path) -> list[int]:
    """Corners of each face of an OBJ."""
    return [len(line.split()) - 1 for line in path.read_text().splitlines() if line.startswith("f ")]


def read(path: Path) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(f'<mujoco><asset><mesh file="{path}" inertia="shell"/></asset></mujoco>')


def surface(model: mujoco.MjModel) -> tuple[float, set[tuple[float, ...]]]:
    """Area, and what corners there are, with their textures."""
    corners = model.mesh_vert[model.mesh_face].astype(np.float64)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    frame = np.empty(9)
    mujoco.mju_quat2Mat(frame, model.mesh_quat[0])
    world = corners @ frame.reshape(3, 3).T + model.mesh_pos[0]
    uvs = model.mesh_texcoord[model.mesh_facetexcoord]
    return float(area), {tuple(np.round(row, 3) + 0.0) for row in np.concatenate([world, uvs], -1).reshape(-1, 5)}


def test_flat_quads_are_one_face_and_the_same_surface(tmp_path: Path) -> None:
    boxes = [box((1, 2, 3), (2.0 * k, 0, 0)).transformed(rotation("z", 17.0 * k)) for k in range(4)]
    write_obj(tmp_path / "pieces.obj", merge(boxes), is_patchwork=True)
    write_obj(tmp_path / "skin.obj", merge(boxes))
    assert faces_of(tmp_path / "pieces.obj") == [4] * 24
    assert faces_of(tmp_path / "skin.obj") == [3] * 48
    (area, corners), (whole, others) = (surface(read(tmp_path / f"{name}.obj")) for name in ("pieces", "skin"))
    assert abs(area - whole) < 1e-3
    assert corners == others


def test_what_a_reader_could_cut_in_two_ways_stays_cut(tmp_path: Path) -> None:
    bent = [SLOPED[0], SLOPED[1], [1.5, 1.0, 0.1], SLOPED[3]]
    dented = [SLOPED[0], SLOPED[1], [0.6, 0.2, 0.0], [0.5, 1.0, 0.0]]
    square = [[0, 0], [1, 0], [1, 1], [0, 1]]
    for corners, uvs in ((SLOPED, square), (bent, [p[:2] for p in bent]), (dented, [p[:2] for p in dented])):
        write_obj(tmp_path / "a.obj", Mesh.of(corners, TRIANGLES, uvs), is_patchwork=True)
        assert faces_of(tmp_path / "a.obj") == [3, 3]
    write_obj(tmp_path / "a.obj", Mesh.of(SLOPED, TRIANGLES, [p[:2] for p in SLOPED]), is_patchwork=True)
    assert faces_of(tmp_path / "a.obj") == [4]


def test_the_slopes_of_a_roof_mesh_face_one_way() -> None:
    sink = Sink("building")
    for turn in np.radians([5, 95, 185, 275, 12, 170]):
        out = np.array([np.cos(turn), np.sin(turn), 0])
        along = np.array([-out[1], out[0], 0])
        top = np.array([0, 0, 3.0])
        corners = [out * 2 - along, out * 2 + along, top + along, top - along]
        sink.polygon("tile_roof", corners, [(0, 0), (1, 0), (1, 1), (0, 1)])
    chunks = list(chunked(sink.parts(), cell_m=50.0))
    assert "tile_roof" in PITCHED
    assert [chunk.name for chunk in chunks] == [f"building_tile_roof_{side}" for side in SIDES]
    assert [len(chunk.mesh.faces) for chunk in chunks] == [4, 2, 4, 2]
    for chunk, towards in zip(chunks, ((1, 0), (0, 1), (-1, 0), (0, -1)), strict=True):
        corners = chunk.mesh.vertices[chunk.mesh.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, :2]
        assert (normals @ np.array(towards) > 0).all()
