"""The fast depth network: the scale that it sees, what its weights file says of it, and that it learns."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from gear.networks.depth.ddrnet_depth import DdrnetDepth, ddrnet_depth_graph
from gear.networks.depth.options import DepthOptions
from gear.networks.weights import write
from gear.plugins.models.ddrnet23_slim_depth import spec
from gear.plugins.tasks.depth import DepthConfig, DepthTask
from gear.testing.synthetic import synthetic_frame
from gear.testing.tiny_networks import as_batch


def built(**options: object) -> DdrnetDepth:
    network = spec.build(DepthOptions(device="cpu", **options))  # type: ignore[arg-type]
    assert isinstance(network, DdrnetDepth)
    return network


def sizes_seen(network: DdrnetDepth, height: int, width: int) -> tuple[int, ...]:
    seen: list[tuple[int, ...]] = []
    network.graph.register_forward_pre_hook(lambda _graph, inputs: seen.append(tuple(inputs[0].shape[2:])))
    with torch.no_grad():
        depth_m = network({"left": torch.rand((1, 3, height, width), generator=torch.Generator().manual_seed(1))})
    assert depth_m["depth_m"].shape == (1, height, width)
    return seen[0]


def test_it_sees_half_the_sides_in_multiples_of_8() -> None:
    assert sizes_seen(built(weights="none"), 185, 612) == (96, 304)
    assert sizes_seen(built(weights="none", input_scale=1.0), 64, 130) == (64, 128)


def test_weights_say_which_scale_they_were_trained_for(tmp_path: Path) -> None:
    path = tmp_path / "weights.safetensors"
    write(path, ddrnet_depth_graph().state_dict(), {"options": json.dumps({"input_scale": 0.75})})
    assert sizes_seen(built(weights=str(path)), 64, 128) == (48, 96)
    assert sizes_seen(built(weights=str(path), input_scale=0.5), 64, 128) == (32, 64)


def test_training_begins_near_the_depths_of_streets() -> None:
    network = built(weights="none", input_scale=1.0).train()
    with torch.no_grad():
        depth_m = network({"left": torch.rand((2, 3, 128, 256), generator=torch.Generator().manual_seed(1))})["depth_m"]
    assert 5 < float(depth_m.median()) < 20


@pytest.mark.slow
@pytest.mark.parametrize(
    ("precision", "memory"),
    [("float32", torch.contiguous_format), ("bfloat16", torch.channels_last)],
    ids=["float32", "bfloat16"],
)
def test_it_learns_a_street(precision: str, memory: torch.memory_format) -> None:
    """Four pictures are learnt by heart: half as wrong as the best constant after sixty steps.

    At half precision in the order of memory that `gear train` takes then.
    """
    task = DepthTask(DepthConfig(width_px=96, height_px=64))
    samples = [task.ground_truth(*synthetic_frame(task.rig(), index=index, seed=5)) for index in range(4)]
    shown = as_batch([sample.images for sample in samples])
    pictures = {name: picture.contiguous(memory_format=memory) for name, picture in shown.items()}
    network = built(weights="none", precision=precision, input_scale=1.0).train()
    network.module().to(memory_format=memory)
    optimiser = torch.optim.AdamW(network.module().parameters(), lr=1e-3)
    for _ in range(60):
        optimiser.zero_grad()
        torch.stack(list(network(pictures, samples).values())).sum().backward()
        optimiser.step()
    network.eval()
    with torch.no_grad():
        said_m = network(pictures)["depth_m"].numpy()
    truth_m = np.stack([sample.depth_m for sample in samples])
    valid_mask = np.isfinite(truth_m) & (truth_m <= 80)
    errors = np.abs(np.log(said_m[valid_mask]) - np.log(truth_m[valid_mask]))
    constant = np.abs(np.log(truth_m[valid_mask]) - np.median(np.log(truth_m[valid_mask])))
    assert errors.mean() < constant.mean() / 2
