"""Optical flow as files of a sample: KITTI's PNG, the mask of the points that the next picture shows, road users."""

from __future__ import annotations

import numpy as np

from gear.contracts.tasks import Auxiliary
from gear.dataset.layout import FLOWS, auxiliary_path
from gear.dataset.probe_files import AuxiliaryFiles
from gear.formats.driving.flow_png import ACTORS, FLOW, VISIBLE, encode_flow
from gear.formats.png import encode_labels
from gear.groundtruth.optical_flow import Flow

KIND = FLOWS


def flow_files(flow: Flow, camera: str, split: str, index: int) -> AuxiliaryFiles:
    """Encodes the flow of one sample as three files, by their names in the sidecar (the JSON file of the sample).

    Args:
        flow: the flow from this sample to the next one of its sequence.
        camera: name of the camera.
        split: name of the split.
        index: index of the sample.
    """
    known = np.isfinite(flow.flow_px).all(axis=-1)
    facts = {"known_px": int(known.sum()), "visible_px": int(flow.is_visible.sum())}
    mask = np.where(flow.is_visible, np.uint8(255), np.uint8(0))
    files = {
        FLOW.format(camera=camera): (f"{camera}.png", encode_flow(flow.flow_px)),
        VISIBLE.format(camera=camera): (f"{camera}_visible.png", encode_labels(mask)),
        ACTORS.format(camera=camera): (f"{camera}_actors.png", encode_labels(flow.actor_id)),
    }
    return {
        key: (Auxiliary(path=auxiliary_path(split, KIND, index, name), facts=facts), data)
        for key, (name, data) in files.items()
    }
