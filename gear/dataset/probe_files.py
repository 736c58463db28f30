"""Probes: the pixels of one view that change with a patch surface, rendered with the surface white and black.

Light is linear. Let B be the view with all surfaces black, and W_i the view with only surface i white. A view with
patches is

    I = B + sum over i of w_i (W_i - B)

where w_i is the linear colour of surface i's texture at a pixel, in 0..1 (`gear.camera.response.face_light`). W_i - B
contains shading, shadows, air, occluders and soft edges. Noise and the response of the camera are applied later and are
not part of probes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from gear.camera.response import Encoding, Response
from gear.contracts.tasks import Auxiliary, Sidecar
from gear.dataset.files import inside
from gear.dataset.layout import PROBES, auxiliary_path, sidecar_path
from gear.dataset.reading import Dataset, check_hash
from gear.dataset.sealed_json import REPAIR
from gear.dataset.sidecar import no_sidecar
from gear.formats.png import decode_plain
from gear.values.errors import DatasetError, FieldError
from gear.values.frames import UInt16Image
from gear.values.serial import from_json

AuxiliaryFiles = Mapping[str, tuple[Auxiliary, bytes]]
"""Additional files of a sample (such as probes) with their metadata and bytes, by name in the sample's sidecar."""

KIND = PROBES
_SHADES = ("black", "white")
_RESPONSE = ("exposure", "contrast", "encoding")
_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 6, cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_PAETH]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Probe:
    """The pixels of one view that change with one patch surface.

    Attributes:
        surface: name of the surface.
        view: name of the camera.
        left_px, top_px: column and row of the crop's first pixel in the view.
        black: (h, w, 3) uint16 crop in linear light, 0..`LINEAR_FULL_SCALE`, with all surfaces black.
        white: (h, w, 3) uint16 crop with this surface white, not clipped at `LINEAR_FULL_SCALE`.
        response: the camera's response with which the pictures of the sample were made.
    """

    surface: str
    view: str
    left_px: int
    top_px: int
    black: UInt16Image
    white: UInt16Image
    response: Response

    @property
    def name(self) -> str:
        """The name of the probe in the sidecar (the JSON file of the sample), without the suffix `black` or `white`."""
        return f"probe/{self.view}/{self.surface}"


def crop_probe(surface: str, view: str, black: UInt16Image, white: UInt16Image, response: Response) -> Probe | None:
    """Crops two (H, W, 3) uint16 views, with a surface black and white, to the pixels in which they differ.

    Args:
        surface: name of the surface.
        view: name of the camera.
        black, white: views with the black and with the white surface.
        response: exposure and tone curve of the camera.

    Returns:
        The smallest crop with all differing pixels; None if the views are equal.
    """
    reach = (black != white).any(axis=2)
    rows, columns = np.flatnonzero(reach.any(axis=1)), np.flatnonzero(reach.any(axis=0))
    if not rows.size:
        return None
    crop = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return Probe(
        surface=surface,
        view=view,
        left_px=int(columns[0]),
        top_px=int(rows[0]),
        black=black[crop].copy(),
        white=white[crop].copy(),
        response=response,
    )


def probe_files(probes: Sequence[Probe], split: str, index: int) -> AuxiliaryFiles:
    """Encodes each probe as two 16-bit RGB PNG files; returns them by name in the sidecar (the JSON file of the
    sample).

    Args:
        probes: probes of the sample, one per surface and view.
        split: name of the split.
        index: index of the sample.
    """
    files = {}
    for probe in probes:
        response = {name: getattr(probe.response, name) for name in _RESPONSE}
        facts = {"left_px": probe.left_px, "top_px": probe.top_px, "response": response}
        for shade, picture in zip(_SHADES, (probe.black, probe.white), strict=True):
            path = auxiliary_path(split, KIND, index, f"{probe.view}_{probe.surface}_{shade}.png")
            files[f"{probe.name}/{shade}"] = (Auxiliary(path=path, facts=facts), _encode(picture))
    return files


def demand_probes(dataset: Dataset[Any]) -> None:
    """Checks that a split was collected with probes, the renders with black and white patch surfaces.

    Args:
        dataset: the opened split.

    Raises:
        DatasetError: the split has no probes.
    """
    if KIND not in dataset.plan.auxiliary:
        raise DatasetError(
            dataset.root,
            f"split {dataset.plan.info.split!r} has no probes; collect it with --probes (into another --out,"
            " or with --force)",
        )


def probes_of(dataset: Dataset[Any], index: int, view: str) -> tuple[Probe, ...]:
    """Reads the probes of one sample in one view, in the order of the surfaces.

    A surface that changes no pixel of the view has no probe.

    Args:
        dataset: the split.
        index: index of the sample.
        view: name of the camera.

    Raises:
        DatasetError: the split was collected without probes, or a file is missing or damaged.
        IndexError: there is no such sample.
    """
    demand_probes(dataset)
    sidecar = dataset.sidecar(index)
    found = []
    for surface in sidecar.record.surfaces:
        if f"probe/{view}/{surface.name}/black" in sidecar.auxiliary:
            found.append(_read(dataset, sidecar, view, surface.name))
    return tuple(found)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Setting:
    """A `Response` as it is stored."""

    exposure: float
    contrast: float
    encoding: Encoding


@dataclass(frozen=True, slots=True, kw_only=True)
class _Facts:
    """The facts on a probe's file in a sidecar."""

    left_px: int
    top_px: int
    response: _Setting


def _read(dataset: Dataset[Any], sidecar: Sidecar, view: str, surface: str) -> Probe:
    pictures, facts = [], []
    place = dataset.root / sidecar_path(dataset.plan.info.split, sidecar.record.index)
    for shade in _SHADES:
        name = f"probe/{view}/{surface}/{shade}"
        try:
            file = sidecar.auxiliary[name]
            facts.append(from_json(_Facts, file.facts, f"auxiliary.{name}"))
        except (KeyError, FieldError) as error:
            raise no_sidecar(place, error) from error
        path = inside(dataset.root, file.path)
        damaged = DatasetError(path, f"is no probe; {REPAIR}")
        try:
            picture = decode_plain(check_hash(dataset.root, file.path, sidecar.files[file.path]))
        except KeyError as error:
            raise no_sidecar(place, error) from error
        except ValueError as error:
            raise damaged from error
        if picture.dtype != np.uint16 or picture.ndim != 3:
            raise damaged
        pictures.append(np.ascontiguousarray(picture[..., ::-1], dtype=np.uint16))
    black, white = pictures
    there = facts[-1]
    height, width = black.shape[:2]
    camera = next(camera for camera in sidecar.record.cameras if camera.name == view)
    fits = 0 <= there.left_px <= camera.width_px - width and 0 <= there.top_px <= camera.height_px - height
    where = f"auxiliary.probe/{view}/{surface}"
    if facts[0] != there or white.shape != black.shape or not fits:
        raise no_sidecar(place, FieldError(where, "the probe does not lie in the picture"))
    try:
        response = Response(**{name: getattr(there.response, name) for name in _RESPONSE})
    except ValueError as error:
        raise no_sidecar(place, FieldError(where, str(error))) from error
    return Probe(
        surface=surface,
        view=view,
        left_px=there.left_px,
        top_px=there.top_px,
        black=black,
        white=white,
        response=response,
    )


def _encode(picture: UInt16Image) -> bytes:
    done, data = cv2.imencode(".png", np.ascontiguousarray(picture[..., ::-1]), _PNG)
    assert done
    return bytes(data)
