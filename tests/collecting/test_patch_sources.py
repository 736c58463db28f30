from __future__ import annotations

import errno
import json
import os
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from gear.collecting.job import resolve
from gear.collecting.patch_sources import random_patch, read_patch, resolve_patch
from gear.config.collection import CollectionConfig
from gear.values.errors import PatchError
from tests.formats.test_picture_size import bomb


def save(path: Path, picture: np.ndarray) -> Path:
    assert cv2.imwrite(str(path), picture)
    return path


@pytest.fixture
def picture() -> np.ndarray:
    return np.random.default_rng(1).integers(0, 256, (15, 30, 3), dtype=np.uint8)


def test_none_and_random() -> None:
    assert resolve_patch("none", surfaces=2, seed=1).images == ()
    first, again = resolve_patch("random", surfaces=2, seed=1), resolve_patch("random", surfaces=2, seed=1)
    assert first.label == "random"
    assert [i.shape for i in first.images] == [(150, 300, 3)] * 2
    assert not np.array_equal(*first.images)
    assert first.digest == again.digest != resolve_patch("random", surfaces=2, seed=2).digest
    assert 120 < random_patch(1, 0).mean() < 135


def test_a_picture_comes_as_rgb_and_is_named_by_its_hash(tmp_path: Path, picture: np.ndarray) -> None:
    found = resolve_patch(str(save(tmp_path / "my patch.png", picture)), surfaces=1, seed=0)
    assert np.array_equal(found.images[0], picture[..., ::-1])
    assert found.label == f"my-patch-{found.digest[:8]}"
    assert np.array_equal(cv2.imdecode(np.frombuffer(found.files["patch_0.png"], np.uint8), 1), picture)


def test_grey_and_16_bit_pictures_are_read(tmp_path: Path, picture: np.ndarray) -> None:
    grey = resolve_patch(str(save(tmp_path / "g.png", picture[..., 0])), surfaces=1, seed=0).images[0]
    assert np.array_equal(grey, np.repeat(picture[..., :1], 3, 2))
    deep = resolve_patch(str(save(tmp_path / "d.png", picture.astype(np.uint16) * 257)), surfaces=1, seed=0).images[0]
    assert np.array_equal(deep, picture[..., ::-1])


def test_a_folder_gives_one_picture_a_surface_in_order(tmp_path: Path, picture: np.ndarray) -> None:
    for n in range(11):
        save(tmp_path / f"patch_{n}.png", np.full((4, 8, 3), n, np.uint8))
    save(tmp_path / "curves_0.png", picture)
    (tmp_path / "attack.json").write_text("{}")
    found = resolve_patch(str(tmp_path), surfaces=11, seed=0)
    assert [int(i[0, 0, 0]) for i in found.images] == list(range(11))
    assert len(resolve_patch(str(tmp_path), surfaces=2, seed=0).images) == 2


def test_the_ending_of_a_patchs_name_may_be_large(tmp_path: Path, picture: np.ndarray) -> None:
    """As some cameras and scanners write it; the second board showed its neutral face."""
    save(tmp_path / "patch_0.png", picture)
    save(tmp_path / "patch_1.PNG", 255 - picture)
    found = resolve_patch(str(tmp_path), surfaces=2, seed=0)
    assert [int(image[0, 0, 2]) for image in found.images] == [int(picture[0, 0, 0]), 255 - int(picture[0, 0, 0])]


def test_patches_know_where_they_were_made(tmp_path: Path, picture: np.ndarray) -> None:
    save(tmp_path / "patch_0.png", picture)
    assert resolve_patch(str(tmp_path), surfaces=1, seed=0).made_for == ()
    notes = {
        "data": [{"scene": "town10/billboard02"}, {"scene": "town10/billboard01"}, {"scene": "town10/billboard02"}]
    }
    (tmp_path / "attack.json").write_text(json.dumps(notes))
    made = resolve_patch(str(tmp_path), surfaces=1, seed=0)
    assert made.made_for == ("town10/billboard01", "town10/billboard02")
    assert made.digest == resolve_patch(str(tmp_path / "patch_0.png"), surfaces=1, seed=0).digest
    for odd in ("not json", "[]", '{"data": [1]}'):
        (tmp_path / "attack.json").write_text(odd)
        assert resolve_patch(str(tmp_path), surfaces=1, seed=0).made_for == ()


def test_a_patch_in_a_foreign_scene_is_mentioned(tmp_path: Path, picture: np.ndarray) -> None:
    save(tmp_path / "patch_0.png", picture)
    (tmp_path / "attack.json").write_text(json.dumps({"data": [{"scene": "town10/billboard02"}]}))
    for scene, note in (("billboard02", ""), ("billboard01", "were made for town10/billboard02; this is town10/billb")):
        job = resolve(CollectionConfig(task="semseg", scene=scene, patch=str(tmp_path), root=str(tmp_path / "out")))
        assert (note in job.notes[0]) if note else job.notes == ()


def test_the_original_tools_names_are_read(tmp_path: Path, picture: np.ndarray) -> None:
    save(tmp_path / "best_patch_1.png", picture[::-1])
    save(tmp_path / "best_patch_0.png", picture)
    assert np.array_equal(resolve_patch(str(tmp_path), surfaces=2, seed=0).images[1], picture[::-1, :, ::-1])


@pytest.mark.parametrize("name", ["final.png", "final_150.png"])
def test_the_only_picture_of_a_folder_is_the_patch_whatever_its_number(
    name: str, tmp_path: Path, picture: np.ndarray
) -> None:
    save(tmp_path / name, picture)
    assert np.array_equal(resolve_patch(str(tmp_path), surfaces=1, seed=0).images[0], picture[..., ::-1])


def test_what_is_no_patch_is_refused_in_one_line(tmp_path: Path, picture: np.ndarray) -> None:
    (tmp_path / "text.png").write_text("hello")
    (tmp_path / "empty.png").write_bytes(b"")
    save(tmp_path / "dot.png", picture[:1, :1])
    clear = np.dstack([picture, np.full(picture.shape[:2], 100, np.uint8)])
    save(tmp_path / "clear.png", clear)
    photo = cv2.imencode(".jpg", np.tile(picture, (40, 40, 1)))[1].tobytes()
    half = photo[: len(photo) // 2]
    (tmp_path / "cut.jpg").write_bytes(half)
    (tmp_path / "zeros.jpg").write_bytes(half + bytes(len(half)))
    (tmp_path / "grey.jpg").write_bytes(half + b"\xff\xd9")
    for name, message in (
        ("text.png", "not a picture"),
        ("empty.png", "not a picture"),
        ("cut.jpg", "not a picture that can be read, or a damaged one"),
        ("zeros.jpg", "not a picture that can be read, or a damaged one"),
        ("grey.jpg", "not a picture that can be read, or a damaged one"),
        ("dot.png", "is 1 x 1 px; sides of 2 to 8192"),
        ("clear.png", "transparent"),
        ("none.png", "is not there"),
    ):
        with pytest.raises(PatchError, match=message):
            resolve_patch(str(tmp_path / name), surfaces=1, seed=0)
    (tmp_path / "gap").mkdir()
    save(tmp_path / "gap/patch_0.png", picture)
    save(tmp_path / "gap/patch_2.png", picture)
    with pytest.raises(PatchError, match=r"lacks patch_1\.png"):
        resolve_patch(str(tmp_path / "gap"), surfaces=2, seed=0)
    (tmp_path / "bare").mkdir()
    with pytest.raises(PatchError, match=r"has no patch_0\.png"):
        resolve_patch(str(tmp_path / "bare"), surfaces=2, seed=0)


def test_a_patch_that_would_not_be_shown_is_refused(tmp_path: Path, picture: np.ndarray) -> None:
    """The split would say that it shows one."""
    one = save(tmp_path / "patch_0.png", picture)
    for patch in ("random", str(one), str(tmp_path)):
        with pytest.raises(PatchError, match="the scene has no surface for a patch; say none"):
            resolve_patch(patch, surfaces=0, seed=0)
    for patch in (str(one), str(tmp_path)):
        needs = r"has 1 of the 2 pictures that the scene needs.*; give a folder with patch_0\.png to patch_1\.png"
        with pytest.raises(PatchError, match=needs):
            resolve_patch(patch, surfaces=2, seed=0)
    assert resolve_patch("none", surfaces=0, seed=0).by_surface(()) == {}
    assert resolve_patch("none", surfaces=2, seed=0).by_surface(("surface_0", "surface_1")) == {}
    for scene, message in (("no_billboard", "no surface for a patch"), ("billboard05", "has 1 of the 2 pictures")):
        with pytest.raises(PatchError, match=message):
            resolve(CollectionConfig(task="semseg", scene=scene, patch=str(one), root=str(tmp_path / "out")))


def test_an_unreadable_patch_is_one_line(tmp_path: Path, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(PatchError, match="cannot be read: File name too long"):
        resolve_patch("a" * 300, surfaces=1, seed=0)

    def closed(folder: Path) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(folder))

    save(tmp_path / "patch_0.png", picture)
    monkeypatch.setattr(Path, "iterdir", closed)
    with pytest.raises(PatchError, match=f"{tmp_path}: cannot be read: Permission denied"):
        resolve_patch(str(tmp_path), surfaces=1, seed=0)


def test_shipped_patches_are_found_by_name(
    tmp_path: Path, picture: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "patches" / "semseg-billboard01"
    folder.mkdir(parents=True)
    save(folder / "patch_0.png", picture)
    monkeypatch.setattr("gear.networks.shipped.shipped_folders", lambda: (tmp_path,))
    found = resolve_patch("semseg-billboard01", surfaces=1, seed=0)
    assert np.array_equal(found.images[0], picture[..., ::-1])
    assert found.label.startswith("semseg-billboard01-")
    with pytest.raises(PatchError, match="did you mean semseg-billboard01"):
        resolve_patch("semseg-bilboard01", surfaces=1, seed=0)


def test_a_patch_that_unpacks_to_gigabytes_is_refused_by_its_header(tmp_path: Path) -> None:
    path = tmp_path / "bomb.png"
    path.write_bytes(bomb(14000))
    with pytest.raises(PatchError, match="is 14000 x 14000 px; sides of 2 to 8192 px are possible"):
        resolve_patch(str(path), surfaces=1, seed=0)


def test_what_is_no_file_is_refused_at_once(tmp_path: Path, picture: np.ndarray) -> None:
    os.mkfifo(tmp_path / "fifo.png")
    for path, kind in (("/dev/zero", "character device"), (str(tmp_path / "fifo.png"), "FIFO")):
        with pytest.raises(PatchError, match=f"cannot be read: is a {kind}; a file was asked for"):
            resolve_patch(path, surfaces=1, seed=0)
    folder = tmp_path / "patches"
    folder.mkdir()
    save(folder / "patch_0.png", picture)
    os.mkfifo(folder / "attack.json")
    assert resolve_patch(str(folder), surfaces=1, seed=0).made_for == ()


def test_sixteen_bits_become_the_nearest_of_eight(tmp_path: Path) -> None:
    deep = np.random.default_rng(3).integers(0, 65536, (7, 9, 3), dtype=np.uint16)
    found = read_patch(save(tmp_path / "deep.png", deep))
    assert np.array_equal(found, np.rint(deep[..., ::-1] / 257).astype(np.uint8))


@pytest.mark.parametrize(("orientation", "turned"), [(1, 0), (3, 2), (6, 3), (8, 1)])
def test_a_photograph_is_turned_as_viewers_turn_it(orientation: int, turned: int, tmp_path: Path) -> None:
    """EXIF 2.32, tag 0x0112: 3 is upside down, 6 has its top on the right, 8 on the left."""
    halves = np.zeros((32, 64, 3), np.uint8)
    halves[:, 32:] = (255, 128, 0)
    data = cv2.imencode(".jpg", halves, [cv2.IMWRITE_JPEG_QUALITY, 100])[1].tobytes()
    tag = b"MM\0*" + struct.pack(">I", 8) + struct.pack(">HHHIHHI", 1, 0x112, 3, 1, orientation, 0, 0)
    exif = b"Exif\0\0" + tag
    path = tmp_path / "photo.jpg"
    path.write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + data[2:])
    expected = np.rot90(halves[..., ::-1], turned)
    found = read_patch(path)
    assert found.shape == expected.shape and np.abs(found.astype(int) - expected).mean() < 8
