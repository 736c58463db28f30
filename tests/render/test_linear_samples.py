"""From samples to frames."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gear.render.linear_samples import edge_mask, four_times, ids_from_rgb, smooth_edges, sum_2x2
from gear.render.pinhole import FAR_M, NEAR_M, depth_from_reversed
from gear.values.geometry import Intrinsics


@given(hnp.arrays(np.uint8, st.tuples(st.integers(1, 5), st.integers(1, 5)).map(lambda s: (2 * s[0], 2 * s[1], 3))))
def test_sums_of_four(samples: np.ndarray) -> None:
    wide = samples.astype(int)
    expected = wide[::2, ::2] + wide[1::2, ::2] + wide[::2, 1::2] + wide[1::2, 1::2]
    got = sum_2x2(samples)
    assert got.dtype == np.uint16 and np.array_equal(got, expected)


def test_one_sample_has_the_same_full_scale() -> None:
    samples = np.arange(256, dtype=np.uint8).reshape(1, 256, 1).repeat(3, axis=2)
    got = four_times(samples)
    assert got.dtype == np.uint16 and np.array_equal(got, samples.astype(int) * 4)


@given(st.lists(st.integers(-1, 2**24 - 2), min_size=1, max_size=20))
def test_ids_from_their_colours(ids: list[int]) -> None:
    pixels = np.array([[(i + 1) & 255, (i + 1) >> 8 & 255, (i + 1) >> 16] for i in ids], np.uint8)[None]
    got = ids_from_rgb(pixels)
    assert got.dtype == np.int32 and got.tolist() == [ids]


def test_depth_from_a_reversed_buffer() -> None:
    z = np.array([NEAR_M, 1.0, 25.0, 700.0, FAR_M * 0.999])
    buffer = (NEAR_M * (FAR_M - z) / (z * (FAR_M - NEAR_M))).astype(np.float32)
    got = depth_from_reversed(np.append(buffer, np.float32(0))[None].copy())[0]
    np.testing.assert_allclose(got[:-1], z, rtol=2e-4)
    assert np.isnan(got[-1])


def scene(height: int = 24, width: int = 32) -> tuple[np.ndarray, np.ndarray]:
    """A slanted ground of one geom, the sky, and a box before both."""
    rows = np.arange(height)[:, None].repeat(width, axis=1)
    camera = Intrinsics(width, height, 20.0)
    with np.errstate(divide="ignore"):
        depth = np.where(rows > height / 2, 1.5 * camera.focal_px / (rows - camera.cy_px), np.nan)
    ids = np.where(rows > height / 2, 0, -1)
    ids[8:18, 10:20], depth[8:18, 10:20] = 1, 2.0
    return ids.astype(np.int32), depth.astype(np.float32)


def test_edges_are_where_something_ends() -> None:
    ids, depth = scene()
    edges = edge_mask(ids, depth)
    assert set(np.unique(edges)) == {0, 255}
    assert (edges[10:16, 9:11] == 255).all() and (edges[10:16, 19:21] == 255).all()
    assert (edges[10:16, 12:18] == 0).all(), "no edge inside the box"
    assert (edges[19:, :] == 0).all(), "a slanted plane is no edge, however steep"


def test_a_crease_of_one_geom_is_an_edge() -> None:
    depth = np.full((5, 20), 4.0, np.float32)
    depth[:, 10:] = 4.0 / (1 + 0.05 * np.arange(10))
    edges = edge_mask(np.zeros((5, 20), np.int32), depth)
    assert (edges[:, 9:11] == 255).any(axis=1).all() and (edges[:, :8] == 0).all()


def test_smoothing_keeps_to_edges_and_is_linear() -> None:
    ids, depth = scene()
    rng = np.random.Generator(np.random.PCG64(3))
    first, second = (rng.integers(0, 500, (24, 32, 3)).astype(np.uint16) for _ in range(2))
    kept = edge_mask(ids, depth) == 0
    smooth = smooth_edges(first, ids, depth)
    assert smooth.dtype == np.uint16 and np.array_equal(smooth[kept], first[kept])
    assert np.abs(smooth[~kept].astype(int) - first[~kept]).max() > 50
    together = smooth_edges(first + second, ids, depth).astype(int)
    assert np.abs(together - smooth - smooth_edges(second, ids, depth)).max() <= 2
