"""`gear.average_weights`: the weighted mean of two sets of weights of one network.

A fine-tuned network and the network from which it was trained often lie in the same valley of the loss. On scenes that
neither was trained on, the average of both sets of weights can be better than either (Wortsman et al., "Robust
fine-tuning of zero-shot models", CVPR 2022, section 3).
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from torch import Tensor

from gear.dataset.files import read_bytes, sha256
from gear.networks.shipped import inspect
from gear.networks.weights import OPTIONAL, mismatches, read, write
from gear.values.errors import GearError
from gear.values.serial import Json
from gear.verbs.weights.convert import ConvertReport, check_target
from gear.verbs.weights.show import file_of

NETWORK = ("model", "task", "options")
"""Metadata keys whose values must be equal if both files have them."""

MEASURED = ("metrics", "intervals", "source", "source_sha256")
"""Metadata keys that are not copied, because they describe only one of the averaged files."""


def average_weights(
    first: str | Path, second: str | Path, out: str | Path, *, share: float = 0.5, halves: bool = False
) -> ConvertReport:
    """Writes the weights `(1 - share) * first + share * second`; integer tensors are those of `second`.

    The new file has the metadata of `second`, without metrics. The training data of both files are listed, and the
    hashes of both files are stored under `averaged`.

    Args:
        first: a safetensors file, or the name of a model with shipped weights.
        second: a safetensors file, or the name of a model with shipped weights.
        out: file to write.
        share: weight of the second file, between 0 and 1 (both excluded).
        halves: whether tensors with two or more dimensions are stored in float16.

    Raises:
        GearError: the files belong to different networks, cannot be read, or cannot be written.
    """
    if not 0 < share < 1:
        raise GearError(f"--share {share:g}: must be between 0 and 1, and neither")
    one, two, target = file_of(first), file_of(second), Path(out)
    check_target(target, one, two)
    (state_one, said_one), (state_two, said_two) = read(one), read(two)
    for key in NETWORK:
        if key in said_one and key in said_two and said_one[key] != said_two[key]:
            raise GearError(
                f"{two}: is of {key} {said_two[key]}, {one} of {said_one[key]}; only states of one network have a mean"
            )
    counters = {key: value for key, value in state_two.items() if key.endswith(OPTIONAL)}
    problems = mismatches(counters | state_one, state_two)
    if problems:
        raise GearError(f"{two}: not of the same network as {one}: {'; '.join(problems)}")
    broken = mismatches(state_one, state_one)
    if broken:
        raise GearError(f"{one}: has no mean with anything: {'; '.join(broken)}")
    state = {key: _between(state_one.get(key, value), value, share) for key, value in state_two.items()}
    metadata = {key: text for key, text in (said_one | said_two).items() if key not in MEASURED}
    metadata["averaged"] = json.dumps(
        {"first_sha256": sha256(read_bytes(one)), "second_sha256": sha256(read_bytes(two)), "share": share}
    )
    metadata["command"] = shlex.join(
        ["gear", "weights", "average", str(first), str(second), str(out), "--share", f"{share}"]
        + (["--half"] if halves else [])
    )
    data = _both(inspect(one).facts().get("data"), inspect(two).facts().get("data"))
    if data is not None:
        metadata["data"] = json.dumps(data, sort_keys=True)
    write(target, state, metadata, halves=halves)
    return ConvertReport.of(metadata.get("model", target.stem), target, len(state))


def _between(one: Tensor, two: Tensor, share: float) -> Tensor:
    if not two.is_floating_point():
        return two
    return ((1 - share) * one.double() + share * two.double()).to(two.dtype)


def _both(one: Json, two: Json) -> Json:
    """Returns the training data of both files; if the data of one file are not recorded, only those of the other
    file.
    """
    if not (isinstance(one, Mapping) and isinstance(two, Mapping)):
        return two if two is not None else one
    merged: dict[str, Any] = dict(two)
    for key, rows in one.items():
        there = merged.get(key, [])
        if isinstance(rows, list) and isinstance(there, list):
            merged[key] = [*rows, *(row for row in there if row not in rows)]
    return merged
