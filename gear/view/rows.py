"""The metadata of one sample as JSON: the part for the overview of the page, and the part for the sample's own view."""

from __future__ import annotations

import math
from typing import Any

from gear.contracts.tasks import Sidecar
from gear.values.geometry import RigidTransform
from gear.values.ground_truth import SurfaceTruth
from gear.values.scene import CameraRecord, SceneRecord, SurfaceRecord
from gear.values.serial import Json, to_json
from gear.view.counts import count
from gear.view.measures import measures
from gear.view.surface_occlusion import hidden


def row(sidecar: Sidecar) -> dict[str, Json]:
    """Returns the overview data of one sample: positions of actors and cameras from above, surfaces, histograms and
    measures.

    Args:
        sidecar: metadata of the sample.

    Returns:
        JSON by key; `boards` are the surfaces as seen from above, `surfaces` their visibility in each camera, `counts`
        the histograms, `things` the measures of objects.
    """
    record = sidecar.record
    return {
        "index": record.index,
        "sequence": record.sequence,
        "frame": record.frame,
        "time_s": record.time_s,
        "weather": record.weather.name,
        "actors": [
            [a.asset, a.role, a.id, *_from_above(a.world_from_actor.transform("world", "actor"))] for a in record.actors
        ],
        "cameras": [_camera(camera) for camera in record.cameras],
        "boards": [_board(record, surface) for surface in record.surfaces],
        "surfaces": [_surface(truth, record) for truth in sidecar.surfaces],
        "counts": count(sidecar.facts),
        "things": measures(sidecar.facts),
    }


def detail(sidecar: Sidecar, links: dict[str, str]) -> dict[str, Json]:
    """Returns all other metadata of a sample, which the page reads only when the user opens the sample.

    Args:
        sidecar: metadata of the sample.
        links: links from the page to picture files of the sample, by path in the dataset.

    Returns:
        The keys are `record`, `surfaces`, `facts` (metadata of the task) and `files` (path, SHA-256, and link or None).
    """
    return {
        "record": to_json(sidecar.record),
        "surfaces": to_json(sidecar.surfaces),
        "facts": sidecar.facts,
        "files": [[path, digest, links.get(path)] for path, digest in sidecar.files.items()],
    }


def finite(value: Any) -> Json:
    """Returns a copy of the JSON value `value` in which None replaces NaN and infinities, which JSON does not allow;
    tuples become lists.
    """
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return value


def _from_above(world_from_thing: RigidTransform) -> list[float]:
    """Returns [east in metres, north in metres, heading in radians counter-clockwise from east]."""
    x, y, _ = world_from_thing.translation_m
    return [round(float(x), 2), round(float(y), 2), round(world_from_thing.yaw_rad, 3)]


def _camera(camera: CameraRecord) -> dict[str, Json]:
    world_from_camera = camera.world_from_camera_transform
    forward = world_from_camera.rotation[:, 2]
    x, y, _ = world_from_camera.translation_m
    return {
        "name": camera.name,
        "width": camera.width_px,
        "height": camera.height_px,
        "x": round(float(x), 2),
        "y": round(float(y), 2),
        "heading": round(math.atan2(forward[1], forward[0]), 3),
        "hfov": round(camera.intrinsics.hfov_rad, 3),
    }


def _board(record: SceneRecord, surface: SurfaceRecord) -> dict[str, Json]:
    """Returns both ends of a surface as seen from above, in metres, and the unit vector towards its viewer."""
    world_from_surface = record.world_from_surface(surface)
    right = world_from_surface.rotation[:, 0] * surface.width_m / 2
    outward = -world_from_surface.rotation[:, 2]
    middle = world_from_surface.translation_m
    return {
        "name": surface.name,
        "asset": surface.asset,
        "ends": [[round(float(v), 2) for v in end[:2]] for end in (middle - right, middle + right)],
        "outward": [round(float(v), 3) for v in outward[:2]],
    }


def _surface(truth: SurfaceTruth, record: SceneRecord) -> dict[str, Json]:
    camera = next((camera for camera in record.cameras if camera.name == truth.camera), None)
    covered = hidden(truth, camera) if camera else None
    return {
        "name": truth.name,
        "camera": truth.camera,
        "corners": [[round(x, 1), round(y, 1)] for x, y in truth.corners_px] if truth.corners_px else None,
        "visible": round(truth.visible_fraction, 4),
        "occluded": None if covered is None else covered.occluded_fraction,
        "truncated": None if covered is None else covered.truncated_fraction,
        "distance": round(truth.distance_m, 2),
        "incidence": round(truth.incidence_deg, 1),
        "pixels": truth.visible_px,
    }
