from __future__ import annotations

import argparse
import json
import shlex
from pathlib import Path
from typing import Any

import pytest
import torch

from gear.cli.main import main
from gear.config.overrides import with_overrides
from gear.networks import shipped
from gear.networks.segmentation.bisenet import BiSeNetX39
from gear.networks.segmentation.ddrnet import DDRNet23Slim
from gear.networks.weights import read, write
from gear.plugins.build import NO_OPTIONS, build, find
from gear.values.errors import GearError, UnknownNameError
from gear.verbs.weights.average import average_weights
from gear.verbs.weights.convert import convert_weights
from gear.verbs.weights.show import show_weights


@pytest.fixture(scope="module")
def official(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Files of the shapes that the authors publish, with random numbers in them."""
    folder = tmp_path_factory.mktemp("official")
    ddrnet: dict[str, Any] = {f"model.{key}": value for key, value in DDRNet23Slim(19).state_dict().items()}
    torch.save(ddrnet | {"loss.criterion.weight": torch.ones(19)}, folder / "ddrnet.pth")
    bisenet = BiSeNetX39(19).state_dict()
    content = {"model": bisenet, "optimizer": {"state": {}}, "epoch": 79, "iteration": 80000}
    torch.save(content, folder / "bisenet.pth", _use_new_zipfile_serialization=False)
    return {path.stem: path for path in folder.iterdir()}


@pytest.mark.parametrize(
    ("model", "file", "tensors"), [("ddrnet23_slim", "ddrnet", 346), ("bisenet_x39", "bisenet", 461)]
)
def test_official_files_become_safetensors(
    official: dict[str, Path], tmp_path: Path, model: str, file: str, tensors: int, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / f"{model}.safetensors"
    assert main(["weights", "convert", model, str(official[file]), str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["tensors"] == tensors and said["model"] == model
    facts = show_weights(str(out))
    assert facts.sha256 == said["sha256"]
    assert facts.file.metadata["model"] == model and facts.file.metadata["source"] == f"{file}.pth"
    assert len(facts.file.metadata["source_sha256"]) == 64
    state, _ = read(out)
    content = torch.load(official[file], weights_only=True)
    old = content.get("model", content)
    key = "model.spp.scale0.2.weight" if model == "ddrnet23_slim" else "heads.2.conv_1x1.bias"
    assert torch.equal(state[key.removeprefix("model.")], old[key])
    assert main(["weights", "convert", model, str(out), str(tmp_path / "again.safetensors")]) == 0, "its own output too"


def test_same_file_same_bytes(official: dict[str, Path], tmp_path: Path) -> None:
    one = convert_weights("bisenet_x39", official["bisenet"], tmp_path / "a.safetensors")
    two = convert_weights("bisenet_x39", official["bisenet"], tmp_path / "b.safetensors")
    half = convert_weights("bisenet_x39", official["bisenet"], tmp_path / "c.safetensors", halves=True)
    assert one.sha256 == two.sha256 != half.sha256
    assert half.size_mb < 0.6 * one.size_mb
    assert "--set weights=" in one.summary() and one.sha256 in one.summary()


def test_what_does_not_fit_is_refused_and_nothing_is_written(official: dict[str, Path], tmp_path: Path) -> None:
    out = tmp_path / "a.safetensors"
    with pytest.raises(GearError, match=r"not weights of bisenet_x39: 394 missing .* 347 not known"):
        convert_weights("bisenet_x39", official["ddrnet"], out)
    with pytest.raises(GearError, match=r"16 not known \(heads\.0"):
        convert_weights("bisenet_x39", official["bisenet"], out, settings=["auxiliary=false"])
    with pytest.raises(GearError, match=r"end in \.safetensors"):
        convert_weights("bisenet_x39", official["bisenet"], tmp_path / "a.pth")
    assert list(tmp_path.iterdir()) == []
    convert_weights("bisenet_x39", official["bisenet"], out)
    with pytest.raises(GearError, match="is the file to read"):
        convert_weights("bisenet_x39", out, out)


def test_metadata_of_a_file_is_kept_and_options_are_recorded(official: dict[str, Path], tmp_path: Path) -> None:
    first, second = tmp_path / "a.safetensors", tmp_path / "b.safetensors"
    state = read(_converted(official, tmp_path))[0]
    state = {key: value for key, value in state.items() if not key.startswith(("heads.0", "heads.1"))}
    write(first, state, {"model": "bisenet_x39", "seed": "7", "options": json.dumps({"input_scale": 0.75})})
    said = ["auxiliary=false", "device=cpu"]  # where it ran is not how the weights are to be used
    convert_weights("bisenet_x39", first, second, settings=said, halves=True)
    metadata = read(second)[1]
    assert metadata["seed"] == "7" and metadata["source"] == "a.safetensors"
    assert json.loads(metadata["options"]) == {"auxiliary": False, "input_scale": 0.75}
    (network,) = [
        build(find("model", "bisenet_x39"), with_overrides(NO_OPTIONS, [f"weights={second}", "auxiliary=false"]))
    ]
    assert network.input_scale == 0.75


@pytest.mark.parametrize("said", [0, -1, 9, "much", True, [0.5]])
def test_a_size_that_is_none_is_refused(official: dict[str, Path], tmp_path: Path, said: Any) -> None:
    path = tmp_path / "a.safetensors"
    write(path, read(_converted(official, tmp_path))[0], {"options": json.dumps({"input_scale": said})})
    with pytest.raises(GearError, match=r"a\.safetensors: says input_scale .* say --model-set input_scale="):
        build(find("model", "bisenet_x39"), with_overrides(NO_OPTIONS, [f"weights={path}"]))
    own = build(find("model", "bisenet_x39"), with_overrides(NO_OPTIONS, [f"weights={path}", "input_scale=0.5"]))
    assert own.input_scale == 0.5


def _converted(official: dict[str, Path], folder: Path) -> Path:
    return convert_weights("bisenet_x39", official["bisenet"], folder / "published.safetensors").path


def test_show_prints_what_the_file_says(
    official: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "models" / "bisenet_x39.safetensors"
    convert_weights("bisenet_x39", official["bisenet"], out)
    assert main(["weights", "show", str(out)]) == 0
    text = capsys.readouterr().out
    assert "461 tensors" in text and "source: bisenet.pth" in text
    monkeypatch.setattr(shipped, "shipped_folders", lambda: (tmp_path,))
    assert show_weights("bisenet_x39").file.path == out
    with pytest.raises(UnknownNameError, match="no model named 'bisenet_x38'; did you mean bisenet_x39"):
        show_weights("bisenet_x38")
    with pytest.raises(GearError, match="is a folder; name the file in it"):
        show_weights(str(tmp_path))
    assert main(["weights", "show", str(official["bisenet"])]) == 2
    assert "gear weights convert" in capsys.readouterr().err


def _two(folder: Path) -> tuple[Path, Path]:
    """A network's states before and after, as files."""
    before, after = folder / "before.safetensors", folder / "after.safetensors"
    data = [json.dumps({"training": [{"scene": "town10/truck", "seed": seed}]}) for seed in (1, 2)]
    said = {"model": "ddrnet23_slim", "task": "semseg", "options": '{"input_scale": 0.5}'}
    for seed, path in enumerate((before, after)):
        torch.manual_seed(seed)
        state = DDRNet23Slim(19).state_dict()
        state["conv1.1.num_batches_tracked"] = torch.tensor(3 + seed)
        write(path, state, said | {"data": data[seed], "metrics": '{"miou": 0.5}', "look_hash": f"look{seed}"})
    return before, after


def test_a_mean_lies_between_and_says_of_what_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before, after = _two(tmp_path)
    out = tmp_path / "mean.safetensors"
    assert main(["weights", "average", str(before), str(after), str(out), "--share", "0.25", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["sha256"] == show_weights(out).sha256
    (one, _), (two, _), (mean, _) = read(before), read(after), read(out)
    for key, value in mean.items():
        wanted = 0.75 * one[key] + 0.25 * two[key] if value.is_floating_point() else two[key]
        torch.testing.assert_close(value, wanted)
        assert value.dtype == two[key].dtype
    facts = show_weights(out).file.facts()
    assert facts["averaged"] == {
        "first_sha256": show_weights(before).sha256, "second_sha256": show_weights(after).sha256, "share": 0.25,
    }  # fmt: skip
    assert facts["data"] == {"training": [{"scene": "town10/truck", "seed": seed} for seed in (1, 2)]}
    assert facts["look_hash"] == "look1" and facts["options"] == {"input_scale": 0.5} and "metrics" not in facts
    network = build(find("model", "ddrnet23_slim"), with_overrides(NO_OPTIONS, [f"weights={out}"]))
    assert network.input_scale == 0.5
    again = average_weights(before, after, out, share=0.25)
    assert again.sha256 == show_weights(out).sha256
    assert average_weights(before, after, tmp_path / "half.safetensors", halves=True).size_mb < 0.6 * again.size_mb
    average_weights(before, after, tmp_path / "exact.safetensors", share=0.12345678, halves=True)
    words = shlex.split(show_weights(tmp_path / "exact.safetensors").file.metadata["command"])
    assert words[-3:] == ["--share", "0.12345678", "--half"]


def test_either_state_may_be_without_counters(tmp_path: Path) -> None:
    """Published files are often older than they are, and a training from them writes them."""
    before, after = _two(tmp_path)
    state, said = read(before)
    older = tmp_path / "older.safetensors"
    write(older, {key: value for key, value in state.items() if not key.endswith("num_batches_tracked")}, said)
    newer = average_weights(older, after, tmp_path / "newer.safetensors")
    assert newer.tensors == len(state) > average_weights(after, older, tmp_path / "short.safetensors").tensors
    average_weights(before, after, tmp_path / "whole.safetensors")
    (one, _), (two, _) = read(newer.path), read(tmp_path / "whole.safetensors")
    assert all(torch.equal(one[key], two[key]) for key in state)


def test_what_has_no_mean_is_refused(
    tmp_path: Path, official: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    before, after = _two(tmp_path)
    out = tmp_path / "out.safetensors"
    other = _converted(official, tmp_path)
    state, said = read(after)
    for share in (0.0, 1.0, -1.0, float("nan")):
        with pytest.raises(GearError, match="must be between 0 and 1"):
            average_weights(before, after, out, share=share)
    with pytest.raises(GearError, match=r"is of model bisenet_x39, .* of ddrnet23_slim; only states of one network"):
        average_weights(before, other, out)
    write(tmp_path / "larger.safetensors", state, said | {"options": '{"input_scale": 1.0}'})
    with pytest.raises(GearError, match=r"is of options .*1\.0"):
        average_weights(before, tmp_path / "larger.safetensors", out)
    write(tmp_path / "short.safetensors", {k: v for k, v in state.items() if k != "conv1.0.bias"}, said)
    with pytest.raises(GearError, match=r"not of the same network as .*1 missing \(conv1\.0\.bias\)"):
        average_weights(before, tmp_path / "short.safetensors", out)
    write(tmp_path / "broken.safetensors", state | {"conv1.0.bias": state["conv1.0.bias"] * float("nan")}, said)
    for files in (("broken.safetensors", after.name), (after.name, "broken.safetensors")):
        with pytest.raises(GearError, match=r"1 with numbers that are not finite \(conv1\.0\.bias\)"):
            average_weights(*(tmp_path / file for file in files), out)
    with pytest.raises(GearError, match="is the file to read"):
        average_weights(before, after, after)
    with pytest.raises(GearError, match="there is no such weights file"):
        average_weights(before, tmp_path / "none.safetensors", out)
    assert not out.exists()
    (tmp_path / "models").mkdir()
    before.rename(tmp_path / "models" / "ddrnet23_slim.safetensors")
    monkeypatch.setattr(shipped, "shipped_folders", lambda: (tmp_path,))
    assert average_weights("ddrnet23_slim", after, out).model == "ddrnet23_slim"


@pytest.fixture(scope="module")
def bisenet() -> dict[str, torch.Tensor]:
    return dict(BiSeNetX39(19).state_dict())


def _behind(prefix: str, state: dict[str, torch.Tensor]) -> dict[str, Any]:
    return {prefix + key: value for key, value in state.items()}


@pytest.mark.parametrize(
    ("wrap", "entry"),
    [
        (lambda state: _behind("_orig_mod.", state), "_orig_mod"),
        (lambda state: _behind("net.module.", state), "net.module"),
        (lambda state: {"checkpoint": state}, "checkpoint"),
        (lambda state: {"checkpoint": {"model": _behind("module.", state)}}, "checkpoint.model.module"),
        (lambda state: {"model": state, "args": argparse.Namespace(lr=0.1)}, "model"),
        (lambda state: {"state_dict": _behind("model.", state) | {"loss.weight": torch.ones(9)}}, "state_dict.model"),
        (lambda state: state, ""),
    ],
    ids=["compiled", "lightning", "nested", "nested parallel", "arguments", "criterion", "plain"],
)  # fmt: skip
def test_wrapped_states_are_found_by_the_networks_own_keys(
    bisenet: dict[str, torch.Tensor], tmp_path: Path, wrap: Any, entry: str
) -> None:
    torch.save(wrap(bisenet), tmp_path / "a.pth")
    report = convert_weights("bisenet_x39", tmp_path / "a.pth", tmp_path / "a.safetensors")
    assert (report.entry, report.others, report.tensors) == (entry, (), 461)
    assert (f"taken from: {entry}\n" in report.summary()) == bool(entry)
    assert torch.equal(read(report.path)[0]["heads.2.conv_1x1.bias"], bisenet["heads.2.conv_1x1.bias"])


def test_of_several_that_fit_the_report_says_which_was_taken(
    bisenet: dict[str, torch.Tensor], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    averaged = {key: value + 1 if value.is_floating_point() else value for key, value in bisenet.items()}
    torch.save({"ema": {"module": averaged}, "model": bisenet}, tmp_path / "a.pth")
    words = ["weights", "convert", "bisenet_x39", str(tmp_path / "a.pth")]
    assert main([*words, str(tmp_path / "a.safetensors")]) == 0
    said = capsys.readouterr().out
    assert "taken from: model\nfits, too, and was not taken (--entry NAME): ema.module\n" in said
    assert main([*words, str(tmp_path / "b.safetensors"), "--entry", "ema.module", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["entry"] == "ema.module"
    key = "heads.2.conv_1x1.bias"
    assert torch.equal(read(tmp_path / "b.safetensors")[0][key], bisenet[key] + 1)
    assert main([*words, str(tmp_path / "c.safetensors"), "--entry", "emma"]) == 2
    assert "has no entry 'emma'; it holds model (461 tensors), ema.module (461 tensors)" in capsys.readouterr().err


def test_a_refusal_says_what_the_file_holds_and_what_was_wanted(
    bisenet: dict[str, torch.Tensor], tmp_path: Path
) -> None:
    one_less = {key: value for key, value in bisenet.items() if key != "heads.2.conv_1x1.bias"}
    torch.save({"generator": {"x.y": torch.ones(1)}, "model": _behind("net.", one_less)}, tmp_path / "a.pth")
    with pytest.raises(GearError) as caught:
        convert_weights("bisenet_x39", tmp_path / "a.pth", tmp_path / "a.safetensors")
    text = str(caught.value)
    assert "not weights of bisenet_x39 in 'model.net': 1 missing (heads.2.conv_1x1.bias)" in text
    assert "the file holds model (460 tensors), generator (1 tensors)" in text and "\n" not in text
    torch.save({"x.y": torch.ones(1)}, tmp_path / "b.pth")
    with pytest.raises(GearError, match=r"its keys are like 'x\.y', those of bisenet_x39 like '"):
        convert_weights("bisenet_x39", tmp_path / "b.pth", tmp_path / "a.safetensors")
