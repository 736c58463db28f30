"""The cache of the sky that assets hide: equal values, and damage that only costs time."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gear.camera import occlusion_cache
from gear.camera.contact_shadows import SkyOcclusion
from gear.camera.occlusion_cache import cached_occlusion
from gear.values.frames import Shape

EDGE_M = 0.5


@pytest.fixture(scope="module")
def shape() -> Shape:
    """A tetrahedron that stands on the ground."""
    vertices = EDGE_M * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return Shape(
        vertices_m=vertices,
        faces=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32),
        face_label_code=np.full(4, 25, np.uint8),
        box_centre_m=np.full(3, EDGE_M / 2),
        box_size_m=np.full(3, EDGE_M),
    )


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[Shape]:
    """The shapes whose maps were computed."""
    shapes: list[Shape] = []
    compute = SkyOcclusion.of

    def recorded(shape: Shape) -> SkyOcclusion:
        shapes.append(shape)
        return compute(shape)

    monkeypatch.setattr(SkyOcclusion, "of", staticmethod(recorded))
    return shapes


def test_the_second_call_reads_the_same_map(tmp_path: Path, shape: Shape, computed: list[Shape]) -> None:
    first, second = cached_occlusion(shape, tmp_path), cached_occlusion(shape, tmp_path)
    assert len(computed) == 1
    assert second.cells_per_m == first.cells_per_m
    assert second.share.dtype == np.float32
    np.testing.assert_array_equal(first.share, second.share)
    assert first.share.max() > 0.5


def test_another_shape_has_another_map(tmp_path: Path, shape: Shape, computed: list[Shape]) -> None:
    cached_occlusion(shape, tmp_path)
    cached_occlusion(replace(shape, vertices_m=shape.vertices_m * 0.99), tmp_path)
    assert len(computed) == 2


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "text", "folder", "other size"])
def test_a_damaged_file_is_computed_again(tmp_path: Path, shape: Shape, computed: list[Shape], damage: str) -> None:
    expected = cached_occlusion(shape, tmp_path).share
    (path,) = tmp_path.iterdir()
    content = bytearray(path.read_bytes())
    if damage == "flip":
        content[len(content) // 2] ^= 1
    path.unlink()
    if damage == "folder":
        path.mkdir()
    elif damage == "other size":
        np.savez(path, share=expected[1:])
    else:
        path.write_bytes({"flip": content, "cut": content[:-40], "empty": b"", "text": b"no map"}[damage])
    np.testing.assert_array_equal(cached_occlusion(shape, tmp_path).share, expected)
    assert len(computed) == 2
    if damage != "folder":
        cached_occlusion(shape, tmp_path)
        assert len(computed) == 2


def test_a_folder_that_cannot_be_made_only_costs_time(tmp_path: Path, shape: Shape, computed: list[Shape]) -> None:
    (tmp_path / "file").write_text("")
    cached_occlusion(shape, tmp_path / "file" / "cache")
    assert len(computed) == 1


def test_a_full_cache_loses_its_oldest_maps(tmp_path: Path, shape: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(occlusion_cache, "MOST_MAPS", 2)
    kept: list[set[Path]] = []
    for number, share in enumerate((0.9, 0.8, 0.7)):
        cached_occlusion(replace(shape, vertices_m=share * shape.vertices_m), tmp_path)
        kept.append(set(tmp_path.iterdir()))
        for path in kept[-1] - set().union(*kept[:-1]):
            os.utime(path, (number, number))
    assert len(kept[-1]) == 2 and not kept[0] & kept[-1], "the first map is the oldest"


def test_a_full_cache_keeps_files_that_are_not_its_own(
    tmp_path: Path, shape: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(occlusion_cache, "MOST_MAPS", 0)
    folder, elsewhere = tmp_path / "cache", tmp_path / "mine.npz"
    folder.mkdir()
    elsewhere.write_bytes(b"mine")
    (folder / "thesis.npz").write_bytes(b"mine")
    (folder / f"{'a' * 32}.npz").symlink_to(elsewhere)
    left = folder / ".making-abc_123.npz"
    left.write_bytes(b"half")
    cached_occlusion(shape, folder)
    assert {path.name for path in folder.iterdir()} == {"thesis.npz", f"{'a' * 32}.npz"}
    assert elsewhere.read_bytes() == b"mine"
