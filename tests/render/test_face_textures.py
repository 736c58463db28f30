"""Textures that a surface's face shows."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from gear.render.face_textures import checked_faces, texture_of_face

MODEL = mujoco.MjModel.from_xml_string(
    """<mujoco><asset><texture name="t" type="2d" builtin="flat" rgb1="1 1 1" width="8" height="4"/>
    <material name="m" texture="t"/></asset><worldbody><geom name="bare" size="1"/>
    <geom name="face" size="1" material="m"/></worldbody></mujoco>"""
)
FACE, BARE = MODEL.geom("face").id, MODEL.geom("bare").id


def test_the_texture_is_the_materials() -> None:
    assert texture_of_face(MODEL, FACE) == MODEL.tex("t").id
    with pytest.raises(ValueError, match=r"'bare'.* is no face"):
        texture_of_face(MODEL, BARE)


def test_faces_must_have_the_size_of_their_texture() -> None:
    picture = np.zeros((4, 8, 3), np.uint8)
    checked = checked_faces(MODEL, {FACE: picture})
    assert checked[FACE][0] == MODEL.tex("t").id and checked[FACE][1] is picture
    for wrong in (np.zeros((8, 4, 3), np.uint8), np.zeros((4, 8, 3), np.float32)):
        with pytest.raises(ValueError, match=r"must be uint8 \(4, 8, 3\)"):
            checked_faces(MODEL, {FACE: wrong})
