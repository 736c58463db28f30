"""Reads event files with TensorBoard's own reader."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from gear.values.frames import UInt8Image


@dataclass(frozen=True, kw_only=True)
class ReadLog:
    """The entries of a log: by name, steps with values; texts without their steps."""

    scalars: dict[str, list[tuple[int, float]]]
    pictures: dict[str, list[tuple[int, UInt8Image]]]
    texts: dict[str, str]


def read_log(folder: Path) -> ReadLog:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    found = EventAccumulator(str(folder), size_guidance={"scalars": 0, "images": 0, "tensors": 0}).Reload()
    tags = found.Tags()
    return ReadLog(
        scalars={name: [(one.step, round(one.value, 6)) for one in found.Scalars(name)] for name in tags["scalars"]},
        pictures={
            name: [(one.step, decoded(one.encoded_image_string)) for one in found.Images(name)]
            for name in tags["images"]
        },
        texts={
            name.removesuffix("/text_summary"): found.Tensors(name)[-1].tensor_proto.string_val[0].decode()
            for name in tags["tensors"]
        },
    )


def decoded(png: bytes) -> UInt8Image:
    return np.asarray(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)[..., ::-1])
