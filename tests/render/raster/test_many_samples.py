"""Four samples go where one does not show the same."""

from __future__ import annotations

import numpy as np

from gear.render.raster.many_samples import at_contrasts, at_edges_and_faces

WALL, POST, FACE = 1, 2, 3


def test_edges_and_faces_get_four_samples_and_a_plain_wall_one() -> None:
    geom_id = np.full((20, 40), WALL, np.int32)
    geom_id[:, 10] = POST
    geom_id[5:9, 25:30] = FACE
    depth_m = np.full(geom_id.shape, 12.0, np.float32)
    many = at_edges_and_faces(geom_id, depth_m, [FACE])
    expected = np.zeros_like(many)
    expected[:, 9:12] = True
    expected[4:10, 24:31] = True
    assert np.array_equal(many, expected), "the face, and all pixels beside it"


def test_neighbours_of_other_light_get_four_samples() -> None:
    light = np.full((10, 10, 3), 9000, np.uint16)
    light[:, 5:] = 9100
    assert not at_contrasts(light).any(), "a step that hardly shows"
    light[:, 5:] = 20000
    expected = np.zeros((10, 10), bool)
    expected[:, 4:6] = True
    assert np.array_equal(at_contrasts(light), expected)


def test_number_of_samples_beyond_the_pixels_beside_a_face_does_not_depend_on_it() -> None:
    rng = np.random.Generator(np.random.PCG64(3))
    light = rng.integers(0, 65536, (24, 24, 3)).astype(np.uint16)
    geom_id = np.full((24, 24), WALL, np.int32)
    geom_id[8:14, 8:14] = FACE
    depth_m = np.full(geom_id.shape, 5.0, np.float32)
    shown = [light.copy(), light.copy()]
    shown[0][geom_id == FACE], shown[1][geom_id == FACE] = 0, 65535
    black, white = (at_edges_and_faces(geom_id, depth_m, [FACE]) | at_contrasts(each) for each in shown)
    assert np.array_equal(black, white)
