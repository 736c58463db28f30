from __future__ import annotations

from pathlib import Path

import pytest
import torch
from torch import nn

from gear.networks.options import NetworkOptions
from gear.networks.weights import build_graph, load_into, mismatches, read, write
from gear.values.errors import GearError


def small() -> nn.Sequential:
    return nn.Sequential(nn.Conv2d(3, 4, 3), nn.BatchNorm2d(4))


def test_what_is_written_comes_back(tmp_path: Path) -> None:
    graph = small()
    path = tmp_path / "deep" / "a.safetensors"
    write(path, graph.state_dict(), {"seed": "1"})
    other = small()
    assert load_into(other, path) == {"seed": "1"}
    assert all(torch.equal(a, b) for a, b in zip(graph.parameters(), other.parameters(), strict=True))
    assert [p.name for p in path.parent.iterdir()] == ["a.safetensors"], "nothing half-written stays"


def test_the_same_gives_the_same_bytes(tmp_path: Path) -> None:
    state = small().state_dict()
    texts = {f"key{index}": "x" * index for index in range(9)}
    for name, metadata in (("a", texts), ("b", dict(reversed(texts.items())))):
        write(tmp_path / f"{name}.safetensors", state, metadata)
    data = (tmp_path / "a.safetensors").read_bytes()
    assert data == (tmp_path / "b.safetensors").read_bytes()
    assert (8 + int.from_bytes(data[:8], "little")) % 8 == 0
    again, metadata = read(tmp_path / "a.safetensors")
    assert metadata == texts and again.keys() == state.keys()


def test_views_and_strides_are_no_obstacle(tmp_path: Path) -> None:
    base = torch.arange(12.0).view(3, 4)
    write(tmp_path / "a.safetensors", {"a": base.t(), "b": base[:2]}, {})
    state, _ = read(tmp_path / "a.safetensors")
    assert torch.equal(state["a"], base.t()) and torch.equal(state["b"], base[:2])


def test_halves_are_read_as_floats_and_statistics_stay_whole(tmp_path: Path) -> None:
    graph = small()
    graph[1].running_var.fill_(1e-7)  # type: ignore[union-attr, operator]
    write(tmp_path / "whole.safetensors", graph.state_dict(), {})
    write(tmp_path / "half.safetensors", graph.state_dict(), {}, halves=True)
    assert (tmp_path / "half.safetensors").stat().st_size < (tmp_path / "whole.safetensors").stat().st_size
    state, _ = read(tmp_path / "half.safetensors")
    assert state["0.weight"].dtype == torch.float32
    assert torch.equal(state["0.weight"], graph.state_dict()["0.weight"].half().float())
    assert torch.equal(state["1.running_var"], graph.state_dict()["1.running_var"])


def test_what_no_half_can_say_stays_whole(tmp_path: Path) -> None:
    state = {"large": torch.tensor([[70000.0, 0.1]]), "small": torch.tensor([[65504.0, 0.1]]), "none": torch.ones(0, 2)}
    write(tmp_path / "half.safetensors", state, {}, halves=True)
    found, _ = read(tmp_path / "half.safetensors")
    assert torch.equal(found["large"], state["large"])
    assert torch.equal(found["small"], state["small"].half().float())


@pytest.mark.parametrize("kind", [torch.float8_e4m3fn, torch.float8_e5m2, torch.bfloat16, torch.float16], ids=str)
def test_numbers_that_are_stored_shorter_are_loaded(tmp_path: Path, kind: torch.dtype) -> None:
    graph, path = small(), tmp_path / "short.safetensors"
    state = {key: value.to(kind) if value.dim() > 1 else value for key, value in graph.state_dict().items()}
    write(path, state, {})
    load_into(graph, path)
    assert torch.equal(graph.state_dict()["0.weight"], state["0.weight"].float())
    write(path, state | {"0.weight": torch.full((4, 3, 3, 3), torch.nan).to(kind)}, {})
    with pytest.raises(GearError, match=r"1 with numbers that are not finite \(0.weight\)"):
        load_into(graph, path)


def test_another_networks_file_is_refused_with_the_reason(tmp_path: Path) -> None:
    state = small().state_dict()
    state["0.weight"] = torch.zeros(4, 3, 5, 5)
    state["2.weight"] = state.pop("1.weight")
    write(tmp_path / "a.safetensors", state, {})
    graph = small()
    before = graph[0].weight.clone()
    with pytest.raises(GearError) as caught:
        load_into(graph, tmp_path / "a.safetensors")
    text = str(caught.value)
    assert "1 missing (1.weight)" in text and "1 not known (2.weight)" in text
    assert "0.weight is (4, 3, 5, 5), not (4, 3, 3, 3)" in text and "\n" not in text
    assert torch.equal(graph[0].weight, before)


def test_numbers_that_are_none_are_refused(tmp_path: Path) -> None:
    state = small().state_dict()
    state["0.weight"][1, 0, 0, 0] = float("nan")
    state["1.weight"] = torch.ones(4, dtype=torch.int64)
    write(tmp_path / "a.safetensors", state, {})
    with pytest.raises(GearError) as caught:
        load_into(small(), tmp_path / "a.safetensors")
    text = str(caught.value)
    assert "1 of integers where fractions belong, or the other way round (1.weight)" in text
    assert "1 with numbers that are not finite (0.weight)" in text
    with pytest.raises(GearError, match="is a folder"):
        load_into(small(), tmp_path)


def test_files_older_than_the_counter_load(tmp_path: Path) -> None:
    state = small().state_dict()
    del state["1.num_batches_tracked"]
    assert mismatches(small().state_dict(), state) == []
    write(tmp_path / "a.safetensors", state, {})
    load_into(small(), tmp_path / "a.safetensors")


def test_random_weights_follow_from_the_seed_and_leave_torchs_own_generator_alone() -> None:
    torch.manual_seed(5)
    before = torch.random.get_rng_state()
    one = build_graph(small, NetworkOptions(weights="none", seed=1), "net")
    torch.rand(7)
    same = build_graph(small, NetworkOptions(weights="none", seed=1), "net")
    other = build_graph(small, NetworkOptions(weights="none", seed=2), "net")
    torch.random.set_rng_state(before)
    assert torch.equal(one[0].weight, same[0].weight)
    assert not torch.equal(one[0].weight, other[0].weight)
    build_graph(small, NetworkOptions(weights="none", seed=1), "net")
    assert torch.equal(torch.random.get_rng_state(), before)


def test_a_file_as_weights(tmp_path: Path) -> None:
    graph = small()
    write(tmp_path / "a.safetensors", graph.state_dict(), {})
    loaded = build_graph(small, NetworkOptions(weights=str(tmp_path / "a.safetensors"), seed=9), "net")
    assert torch.equal(loaded[0].weight, graph[0].weight)
    with pytest.raises(GearError, match="no such weights file"):
        build_graph(small, NetworkOptions(weights=str(tmp_path / "b.safetensors")), "net")
