"""Finds the patches that `--patch` refers to: one picture for each patch surface (billboard or truck) of the scene."""

from __future__ import annotations

import difflib
import hashlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from gear.contracts.tasks import NO_PATCH, RANDOM_PATCH
from gear.dataset.json_text import load_json
from gear.formats.jpeg_markers import START
from gear.formats.picture_size import check_size
from gear.formats.quiet_decoder import decode_quietly
from gear.formats.whole_picture import check_whole
from gear.networks.shipped import shipped_patches
from gear.values.errors import DatasetError, PatchError
from gear.values.frames import UInt8Image
from gear.values.regular_file import read_regular
from gear.values.rng import derive_rng

RANDOM_SIZE_PX = (300, 150)
"""Width and height of a random patch: pixels of 2.5 cm on a billboard 7.4 m wide, as in the CARLA-GeAR paper."""

SIDE_PX = (2, 8192)
MAX_BYTES = 256 << 20
NUMBERED = re.compile(r".*_(\d+)\.(?i:png)")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PatchSet:
    """The patches that the scene of a collection shows.

    Attributes:
        label: `none`, `random`, or a name with a hash; also the name of the patches' folder in the dataset.
        images: (H, W, 3) uint8 sRGB pictures in the order of the surfaces; empty without patches.
        digest: sha256 of the pictures; empty without patches.
        files: files to copy into the dataset, content by name.
        source: the value of `--patch`.
        made_for: `town/scene` of the scenes that the patches were optimised in, if an `attack.json` states them.
    """

    label: str
    images: tuple[UInt8Image, ...]
    digest: str
    files: Mapping[str, bytes] = field(default_factory=dict)
    source: str = ""
    made_for: tuple[str, ...] = ()

    def by_surface(self, names: tuple[str, ...]) -> dict[str, UInt8Image]:
        """The picture of each surface, by name of the surface; empty without patches."""
        return dict(zip(names, self.images, strict=True)) if self.images else {}


def resolve_patch(patch: str, *, surfaces: int, seed: int) -> PatchSet:
    """Finds the patches that `--patch` refers to.

    Args:
        patch: `none`, `random`, a picture, a folder with `patch_0.png`, `patch_1.png`, … (or `<anything>_0.png`), or
            the name of a pre-computed patch of an installed weights package.
        surfaces: number of patch surfaces in the scene.
        seed: seed of random patches.

    Raises:
        PatchError: a picture is missing, unreadable or of an impossible size; the numbers of the pictures have a gap;
            or the scene has no surface or too many.
    """
    try:
        found = _resolved(patch, surfaces, seed)
    except OSError as error:
        raise PatchError(patch, f"cannot be read: {error.strerror}") from error
    if found.label != NO_PATCH and not surfaces:
        raise PatchError(patch, "the scene has no surface for a patch; say none, or name a scene with a board or truck")
    if found.label != NO_PATCH and len(found.images) < surfaces:
        problem = f"has {len(found.images)} of the {surfaces} pictures that the scene needs, one for each surface"
        raise PatchError(patch, f"{problem}; give a folder with patch_0.png to patch_{surfaces - 1}.png")
    return found


def _resolved(patch: str, surfaces: int, seed: int) -> PatchSet:
    if patch in ("", NO_PATCH):
        return PatchSet(label=NO_PATCH, images=(), digest="", source=NO_PATCH)
    if patch == RANDOM_PATCH:
        images = tuple(random_patch(seed, i) for i in range(surfaces))
        return _patch_set(RANDOM_PATCH, images, RANDOM_PATCH, is_hashed=False)
    path = Path(patch)
    if not path.exists() and path.name == patch:
        path = shipped_patches().get(patch, path)
    if path.is_dir():
        found = _numbered(path)
        images = tuple(read_patch(p) for p in found[: max(1, surfaces)])
        return replace(_patch_set(path.resolve().name, images, patch), made_for=_scenes(path / "attack.json"))
    if not path.exists():
        near = difflib.get_close_matches(patch, shipped_patches(), n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise PatchError(
            patch, f"is not there; say none, random, a picture, a folder with patch_0.png, or a shipped patch{hint}"
        )
    return _patch_set(path.stem, (read_patch(path),), patch)


def random_patch(seed: int, index: int) -> UInt8Image:
    """A (H, W, 3) uint8 patch of `RANDOM_SIZE_PX`; every pixel and channel is drawn uniformly from 0..255.

    Args:
        seed: seed of the dataset.
        index: number of the surface.
    """
    width, height = RANDOM_SIZE_PX
    rng = derive_rng(seed, "patch", "random", index)
    return rng.integers(0, 256, (height, width, 3), dtype=np.uint8)


def read_patch(path: Path) -> UInt8Image:
    """Reads a patch picture as (H, W, 3) uint8 sRGB; grey is converted to RGB, 16 bits are rounded to 8, and a JPEG is
    turned as its EXIF orientation says.

    Args:
        path: the picture.

    Raises:
        PatchError: the file is not a picture, is transparent, or has an impossible size.
    """
    try:
        data = read_regular(path, most_bytes=MAX_BYTES + 1)
    except OSError as error:
        raise PatchError(path, f"cannot be read: {error.strerror}") from error
    if len(data) > MAX_BYTES:
        raise PatchError(path, f"is larger than {MAX_BYTES >> 20} MiB")
    no_picture = "is not a picture that can be read, or a damaged one; use an 8-bit RGB PNG"
    try:
        check_size(data, least_px=SIDE_PX[0], most_px=SIDE_PX[1])
        check_whole(data)
        # Photographs are often stored on their side, with a note how to turn them; PNG files never are.
        picture = decode_quietly(data, cv2.IMREAD_COLOR if data.startswith(START) else cv2.IMREAD_UNCHANGED)
    except ValueError as error:
        raise PatchError(path, str(error) if " px; sides of " in str(error) else no_picture) from error
    if picture is None:
        raise PatchError(path, no_picture)
    if picture.ndim == 3 and picture.shape[2] == 4:
        if not bool((picture[..., 3] == np.iinfo(picture.dtype).max).all()):
            raise PatchError(path, "is transparent in places; a printed patch is opaque")
        picture = picture[..., :3]
    if picture.dtype == np.uint16:
        picture = _eight_bits(picture)
    elif picture.dtype != np.uint8:
        raise PatchError(path, f"has {picture.dtype} pixels; use an 8-bit RGB PNG")
    picture = np.asarray(picture, np.uint8)
    if picture.ndim == 2:
        picture = np.repeat(picture[..., None], 3, axis=2)
    return np.ascontiguousarray(picture[..., ::-1])


def _eight_bits(picture: npt.NDArray[np.uint16]) -> UInt8Image:
    """Rounds 16-bit values to 8 bits, row by row to save memory."""
    levels = np.empty(picture.shape, np.uint8)
    for row, values in zip(levels, picture, strict=True):
        row[:] = (values.astype(np.uint32) * 255 + 32767) // 65535
    return levels


def as_printed(rgb: npt.NDArray[np.floating[Any]]) -> UInt8Image:
    """Rounds the (H, W, 3) sRGB values of a patch, 0..1, to 8 bits, as a printed patch has them."""
    return np.ascontiguousarray(np.floor(np.clip(rgb, 0, 1) * 255 + 0.5).astype(np.uint8))


def digest_of(images: Iterable[UInt8Image]) -> str:
    """The SHA-256, as 64 hexadecimal digits, over sizes and pixels of patches.

    Args:
        images: (H, W, 3) uint8 patches in the order of their surfaces.
    """
    digest = hashlib.sha256()
    for image in images:
        digest.update(repr(image.shape).encode() + image.tobytes())
    return digest.hexdigest()


def _numbered(folder: Path) -> list[Path]:
    """The pictures `patch_0.png`, `patch_1.png`, … of a folder, or `<anything>_0.png`, or its only picture."""
    pictures = sorted(p for p in folder.iterdir() if p.suffix.lower() == ".png" and p.is_file())
    own = [p for p in pictures if re.fullmatch(r"patch_\d+\.(?i:png)", p.name)]
    if len(pictures) == 1 and not own:
        return pictures
    numbered: dict[int, Path] = {}
    for path in own or pictures:
        match = NUMBERED.fullmatch(path.name)
        if match is None:
            continue
        if int(match[1]) in numbered:
            raise PatchError(folder, f"has two patches of number {match[1]}; name them patch_0.png, patch_1.png, …")
        numbered[int(match[1])] = path
    if not numbered:
        raise PatchError(folder, "has no patch_0.png")
    if sorted(numbered) != list(range(len(numbered))):
        raise PatchError(folder, f"lacks patch_{next(i for i in range(len(numbered) + 1) if i not in numbered)}.png")
    return [numbered[i] for i in range(len(numbered))]


def _scenes(notes: Path) -> tuple[str, ...]:
    """The scenes that the patches were optimised in; empty without a record, or where a picture was changed since."""
    try:
        return tuple(sorted({str(one["scene"]) for one in load_json(notes)["data"]}))
    except (DatasetError, KeyError, TypeError):
        return ()


def _patch_set(name: str, images: tuple[UInt8Image, ...], source: str, *, is_hashed: bool = True) -> PatchSet:
    digest = digest_of(images)
    files = {f"patch_{i}.png": cv2.imencode(".png", image[..., ::-1])[1].tobytes() for i, image in enumerate(images)}
    safe = re.sub(r"[^A-Za-z0-9.]+", "-", name).strip("-.") or "patch"
    label = f"{safe}-{digest[:8]}" if is_hashed else name
    return PatchSet(label=label, images=images, digest=digest, files=files, source=source)
