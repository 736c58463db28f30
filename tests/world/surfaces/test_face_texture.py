"""The face: resampling is linear, keeps orientation, and repeats pixels exactly where it can."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.world.surfaces.face_texture import (
    FACE_SIZE_PX,
    LINEAR_FROM_BYTE,
    box_matrix,
    face_from_patch,
    linear_from_srgb,
    resample_linear,
    srgb_from_linear,
    uniform_face,
)


def quarters(height: int, width: int) -> np.ndarray:
    patch = np.zeros((height, width, 3), np.uint8)
    patch[: height // 2, : width // 2] = (255, 0, 0)
    patch[: height // 2, width // 2 :] = (0, 255, 0)
    patch[height // 2 :, : width // 2] = (0, 0, 255)
    patch[height // 2 :, width // 2 :] = (250, 240, 10)
    return patch


@given(st.integers(1, 700), st.integers(1, 700))
def test_a_row_averages_what_it_covers(source: int, target: int) -> None:
    matrix = box_matrix(source, target)
    assert matrix.shape == (target, source)
    assert np.allclose(matrix.sum(axis=1), 1)
    assert np.allclose(matrix.sum(axis=0), target / source), "every source pixel counts the same"
    assert (matrix >= 0).all()


def test_whole_multiples_repeat_pixels_exactly() -> None:
    patch = np.random.default_rng(1).integers(0, 256, (150, 300, 3), dtype=np.uint8)
    face = face_from_patch(patch)
    assert face.shape == (FACE_SIZE_PX[1], FACE_SIZE_PX[0], 3)
    assert np.array_equal(face, np.kron(patch, np.ones((4, 4, 1), np.uint8)))
    by_matrices = srgb_from_linear(resample_linear(LINEAR_FROM_BYTE[patch])) * 255
    assert np.abs(by_matrices - face).max() < 1e-6, "the short cut and the matrices are one thing"


def test_orientation_is_kept() -> None:
    face = face_from_patch(quarters(77, 91))
    corners = face[10, 10], face[10, -10], face[-10, 10], face[-10, -10]
    assert [tuple(int(v) for v in c) for c in corners] == [(255, 0, 0), (0, 255, 0), (0, 0, 255), (250, 240, 10)]


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 40), st.integers(1, 40), st.integers(0, 2**32 - 1))
def test_resampling_is_linear(height: int, width: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.random((2, height, width, 3))
    size = (24, 12)
    mixed = resample_linear(0.3 * a + 2.0 * b, size)
    assert np.allclose(mixed, 0.3 * resample_linear(a, size) + 2.0 * resample_linear(b, size))


def test_averaging_is_in_linear_light() -> None:
    board = np.indices((1200, 2400)).sum(axis=0) % 2 * 255
    face = face_from_patch(np.repeat(board[..., None].astype(np.uint8), 3, axis=2))
    assert (face == 188).all(), "half the light of white is sRGB 188, not 128"


@given(st.integers(0, 255))
def test_srgb_is_inverted(byte: int) -> None:
    assert srgb_from_linear(linear_from_srgb(byte / 255)) * 255 == pytest.approx(byte)


def test_faces_cannot_be_written_to() -> None:
    for face in (uniform_face(255), face_from_patch(quarters(10, 10)), face_from_patch(quarters(150, 300))):
        with pytest.raises(ValueError, match="read-only"):
            face[0, 0] = 1


@pytest.mark.parametrize("bad", [np.zeros((4, 4), np.uint8), np.zeros((4, 4, 3)), np.zeros((0, 4, 3), np.uint8)])
def test_other_arrays_are_refused(bad: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"must be \(h, w, 3\) uint8"):
        face_from_patch(bad)
