"""Points on triangles."""

from __future__ import annotations

import numpy as np

from gear.camera.surface_points import longest_edges, points_on

TRIANGLES = np.array([[[0, 0, 0], [4, 0, 0], [0, 3, 0]], [[0, 0, 1], [1, 0, 1], [0, 1, 1]]], np.float64)


def test_the_longest_edge_may_be_any_of_the_three() -> None:
    turned = TRIANGLES[:1, [1, 2, 0]]
    assert longest_edges(TRIANGLES).tolist() == [5.0, np.sqrt(2.0)]
    assert longest_edges(turned).tolist() == [5.0]
    assert longest_edges(TRIANGLES[:1, [2, 0, 1]].astype(np.float32)).dtype == np.float32


def test_points_lie_on_their_triangle_and_contain_its_corners() -> None:
    few, many = points_on(TRIANGLES, np.array([1, 3]))
    assert {tuple(point) for point in few.tolist()} == {(0, 0, 0), (4, 0, 0), (0, 3, 0)}
    assert len(many) == 10  # a triangle of 1 + 2 + 3 + 4 points
    assert (many[:, 2] == 1).all()
    assert (many[:, :2] >= 0).all()
    assert (many[:, 0] + many[:, 1]).max() <= 1 + 1e-12
