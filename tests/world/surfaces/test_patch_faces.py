"""Faces: their frames and sizes in the compiled model, their records and their textures."""

from __future__ import annotations

import numpy as np
import pytest

from gear.testing.tiny_town import tiny_world
from gear.world.surfaces.face_texture import FACE_SIZE_PX


def test_a_face_has_the_frame_of_its_board() -> None:
    world = tiny_world("board")
    (face,) = world.faces
    board = world.scene.boards[0]
    frame = face.parent_from_surface
    facing = np.radians(board.facing_deg)
    np.testing.assert_allclose(-frame.rotation[:, 2], [np.cos(facing), np.sin(facing), 0.0], atol=1e-6)
    np.testing.assert_allclose(frame.rotation[:, 1], [0.0, 0.0, -1.0], atol=1e-6)
    np.testing.assert_allclose(frame.translation_m, np.add(board.position_m, (0.0, 0.0, 2.6)), atol=1e-6)
    assert (face.width_m, face.height_m) == pytest.approx((7.4, 3.7), abs=1e-6)


def test_a_carried_face_is_in_the_frame_of_its_actor() -> None:
    world = tiny_world("truck")
    (face,) = world.faces
    assert face.is_carried and face.asset == "truck_box"
    # It is the rear of the truck, which looks back.
    assert face.parent_from_surface.translation_m[0] < 0
    np.testing.assert_allclose(-face.parent_from_surface.rotation[:, 2], [-1.0, 0.0, 0.0], atol=1e-6)
    assert face.record(7).actor_id == 7
    assert tiny_world("board").faces[0].record(7).actor_id is None


def test_textures_are_those_of_the_albedo() -> None:
    face = tiny_world("board").faces[0]
    width, height = FACE_SIZE_PX
    for albedo, byte in (("white", 255), ("black", 0)):
        texture = face.texture(albedo)  # type: ignore[arg-type]
        assert texture.shape == (height, width, 3) and (texture == byte).all()
    assert face.texture("none") is face.neutral
    patch = np.zeros((2, 4, 3), np.uint8)
    patch[0, 0] = (10, 20, 30)
    texture = face.texture(patch)
    assert (texture[: height // 2, : width // 4] == (10, 20, 30)).all() and not texture[height // 2 :].any()
