"""The attacks beside the scene-specific one: through the contract, and what each is for."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import torch
from safetensors.numpy import save_file

from gear.config.nodes import Mapping as MappingNode
from gear.config.nodes import Place
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.attacks import Budget, Patch
from gear.formats import rle
from gear.networks.stereo.rcnn_graph import LOSSES
from gear.plugins.attacks.carla_gear import STEREO_LOSSES_LEFT_OUT, carla_gear
from gear.plugins.attacks.control import ControlConfig, control, matched, read_exact
from gear.plugins.attacks.eot import EotConfig, eot
from gear.plugins.attacks.nes import NesConfig, nes
from gear.plugins.attacks.optimisation.model_group import Group
from gear.plugins.attacks.optimisation.objectives import default_objective
from gear.plugins.attacks.optimisation.regularisers import palette_srgb
from gear.plugins.attacks.optimisation.upright_pasting import Upright
from gear.plugins.attacks.rp2 import Rp2, Rp2Config, rp2
from gear.plugins.attacks.square import SquareConfig, square
from gear.plugins.attacks.thys import ThysConfig, max_score, thys
from gear.plugins.describe import options as described
from gear.testing.attack_contract import AttackContract, Counted
from gear.testing.tiny_compositor import TinyCompositor
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import FieldError, GearError
from gear.values.rng import derive_rng

Options = Mapping[str, Any]
SMALL: Options = {"height_px": 16, "width_px": 32}


class Beside(AttackContract):
    """The contract, with harm measured where these attacks do it: beside the patch."""

    def harm(self, model: Counted, dataset: Any, patches: Any) -> float:
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        pictures = TinyCompositor(dataset).compose(tensors, [0, 1], "left")
        with torch.no_grad():
            terms = default_objective(dataset[0]).terms(model, {"left": pictures}, dataset, [0, 1])
        return sum(float(term.weight * term.value) for term in terms.values())


class TestEot(AttackContract):
    spec = eot
    options: ClassVar[Options] = {**SMALL, "share": 0.3}
    steps = 40

    def harm(self, model: Counted, dataset: Any, patches: Any) -> float:
        """Where the attack believes its patches to be: it knows of no board."""
        scenes = Upright(dataset, seed=3, aspect=0.5, share=0.3, scales=(1.0, 1.0), shift=0.5)
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        with torch.no_grad():
            return float(sum(model.forward({"left": scenes.compose(tensors, [0, 1], "left")}, dataset).values()))


class TestNes(Beside):
    spec = nes
    options: ClassVar[Options] = {**SMALL, "grid_px": 4, "pairs": 4, "batch": 1, "step": 0.2}
    steps = 60
    passes_per_step = 10


class NesOnDepth(TestNes):
    task = "depth"


class TestSpsa(Beside):
    spec = nes
    options: ClassVar[Options] = {**SMALL, "grid_px": 8, "pairs": 4, "draws": "spsa", "batch": 1, "step": 0.2}
    steps = 60
    passes_per_step = 10


class TestSquare(Beside):
    spec = square
    options: ClassVar[Options] = {**SMALL, "batch": 2, "turns": 2}
    steps = 40
    passes_per_step = 3


class TestSquareOnDepth(TestSquare):
    task = "depth"


class TestRp2(Beside):
    spec = rp2
    options: ClassVar[Options] = {"height_px": 8, "width_px": 16}
    steps = 40


class TestControl(AttackContract):
    spec = control
    options: ClassVar[Options] = SMALL


class TestSolid(AttackContract):
    spec = control
    options: ClassVar[Options] = {**SMALL, "kind": "solid", "rgb": (0.1, 0.2, 0.9)}


class Detector(TinySegmenter):
    """A tiny network whose outputs are named as a detector's; every score feels one class in the whole picture."""

    def outputs(self, raw: torch.Tensor) -> Mapping[str, torch.Tensor]:
        everywhere = raw[:, 1:2].mean(dim=(2, 3), keepdim=True)
        return {"cls_logits": (0.05 * raw + everywhere).flatten(2).permute(0, 2, 1)}


class Shortsighted(TinySegmenter):
    """One whose surest score lies far from the patch."""

    def outputs(self, raw: torch.Tensor) -> Mapping[str, torch.Tensor]:
        return {"cls_logits": raw.flatten(2).permute(0, 2, 1)}


def test_thys_hides_what_was_surest() -> None:
    contract = AttackContract()
    dataset, model = contract.dataset(), Detector(TinyConfig())
    compositor = TinyCompositor(dataset)

    def sure(patches: Any) -> float:
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        with torch.no_grad():
            return float(max_score(model.forward({"left": compositor.compose(tensors, [0, 1], "left")})).mean())

    def run(steps: int) -> Any:
        attack = thys.build(ThysConfig(**SMALL))
        return attack.optimise(model, dataset, compositor, budget=Budget(steps=steps), rng=derive_rng(1, "thys"))

    grey = [Patch(name="patch_0", rgb=np.full((4, 8, 3), 0.5, np.float32))]
    assert sure(run(40)) < min(sure(run(1)), sure(grey)) - 1e-3


def test_thys_says_when_the_surest_detection_does_not_feel_the_patch() -> None:
    dataset, attack = AttackContract().dataset(), thys.build(ThysConfig(**SMALL))
    model, compositor = Shortsighted(TinyConfig()), TinyCompositor(dataset)
    with pytest.raises(GearError, match="no gradient reaches the patch"):
        attack.optimise(model, dataset, compositor, budget=Budget(steps=20), rng=derive_rng(1, "thys"))


def test_thys_is_judged_by_what_it_lowers() -> None:
    dataset, model = AttackContract().dataset(), Detector(TinyConfig())
    objective = thys.build(ThysConfig(**SMALL)).objective(dataset[0])
    picture = torch.from_numpy(dataset[0].images["left"].copy()).permute(2, 0, 1)[None].float() / 255
    with torch.no_grad():
        (term,) = objective.terms(model, {"left": picture}, [dataset[0]], [0]).values()
        assert float(term.value) == -float(max_score(model.forward({"left": picture})).mean())


def test_thys_weighs_its_penalties_as_published() -> None:
    """Both are sums divided by the number of values, three a pixel, whatever the number of patches."""
    red = torch.tensor([1.0, 0.0, 0.0]).view(1, 3, 1, 1).expand(2, 3, 4, 8).contiguous()
    config = ThysConfig(printability_weight=0.3)
    (nearest,) = torch.cdist(torch.tensor([[1.0, 0.0, 0.0]]), palette_srgb()).min(dim=1).values
    found = thys.build(config)._penalties(red)
    assert float(found["printability"]) == pytest.approx(-0.3 * float(nearest) / 3, rel=1e-5)
    assert float(found["variation"]) == pytest.approx(-0.1), "flat: no more than what costs nothing"


def test_thys_needs_a_detector() -> None:
    with pytest.raises(GearError, match="needs a detector"):
        max_score({"logits": torch.zeros(1, 2, 3, 3)})


class Opaque(TinySegmenter):
    """Passes no gradient."""

    def forward(self, views: Any, targets: Any | None = None) -> Mapping[str, torch.Tensor]:
        with torch.no_grad():
            return super().forward(views, targets)


def test_penalties_are_no_gradient_of_the_objective() -> None:
    """They shape a patch that no model feels, too."""
    dataset, attack = AttackContract().dataset(), rp2.build(Rp2Config(**SMALL))
    model, compositor = Opaque(TinyConfig()), TinyCompositor(dataset)
    with pytest.raises(GearError, match="no gradient reaches the patch"):
        attack.optimise(model, dataset, compositor, budget=Budget(steps=20), rng=derive_rng(1, "opaque"))


def test_places_are_inside_and_change_with_every_step() -> None:
    dataset = AttackContract().dataset(boards=2)
    scenes = Upright(dataset, seed=3, aspect=0.5, share=0.4, scales=(0.8, 1.2), shift=2.0)
    height, width = dataset[0].images["left"].shape[:2]
    seen = set()
    for step in range(20):
        scenes.begin(step)
        for top, left, rows, columns in scenes.places(0):
            assert top >= 0 and left >= 0 and top + rows <= height and left + columns <= width
            seen.add((top, left, rows, columns))
    assert len(seen) > 20


def test_what_is_pasted_is_where_the_sample_says() -> None:
    dataset = AttackContract().dataset()
    scenes = Upright(dataset, seed=3, aspect=0.5, share=0.4, scales=(0.8, 1.2), shift=0.2)
    red = torch.zeros(3, 4, 8)
    red[0] = 1.0
    picture = scenes.compose([red], [1], "left")[0]
    (truth,) = scenes[1].surfaces
    mask = rle.decode(truth.mask_rle, *dataset[1].images["left"].shape[:2])
    assert mask.sum() == truth.visible_px > 50
    assert (torch.tensor([1.0, 0.0, 0.0]) == picture[:, mask].T).all()
    stored = torch.from_numpy(dataset[1].images["left"].copy()).permute(2, 0, 1) / 255
    assert torch.equal(picture[:, ~mask], stored[:, ~mask])


def test_queries_are_counted_not_steps() -> None:
    contract = TestSquare()
    model, dataset = contract.model(), contract.dataset()
    attack = square.build(SquareConfig(**contract.options))
    attack.optimise(
        model, dataset, TinyCompositor(dataset), budget=Budget(steps=10_000, queries=17), rng=derive_rng(1, "q")
    )
    assert 15 <= model.passes <= 17
    with pytest.raises(GearError, match="--queries"):
        nes.build(NesConfig(**SMALL)).optimise(
            model, dataset, TinyCompositor(dataset), budget=Budget(steps=3), rng=derive_rng(1, "q")
        )


def test_a_pair_pays_for_a_clean_answer_once() -> None:
    """In depth the first look at a sample costs one query more, and the second of a pair is none."""
    contract = NesOnDepth()
    model, dataset = contract.model(), contract.dataset()
    attack = nes.build(NesConfig(**contract.options))
    attack.optimise(model, dataset, TinyCompositor(dataset), budget=Budget(steps=9, queries=3), rng=derive_rng(1, "q"))
    assert model.passes == 3


@pytest.mark.parametrize("models", [1, 3])
def test_other_samples_are_drawn_as_often_whatever_the_number_of_models(models: int) -> None:
    seen: list[int] = []

    class Noting(TinyCompositor):
        def compose(self, patches: Any, samples: Any, view: str) -> torch.Tensor:
            seen.append(samples[0])
            return super().compose(patches, samples, view)

    contract = TestSquare()
    dataset = contract.dataset()
    network = Group({f"m{n}": TinySegmenter(TinyConfig(seed=n)) for n in range(models)})
    attack = square.build(SquareConfig(**SMALL, batch=1, turns=6))
    budget = Budget(steps=10_000, queries=66 * models)
    attack.optimise(network, dataset, Noting(dataset), budget=budget, rng=derive_rng(1, "q"))
    runs = [len(list(same)) for _, same in itertools.groupby(seen)]
    assert len(seen) == 66, "as many questions as there are queries for"
    assert max(runs) <= 2 * (66 // 6 + 1), "one turn, or two where one pass ends and the next begins"


def test_matched_noise_is_like_the_patch_and_not_the_patch(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    x = np.linspace(0, 6, 64)
    waves = 0.5 + 0.2 * np.sin(x)[None, :, None] * np.array([1.0, 0.6, 0.2]) + 0.03 * rng.standard_normal((32, 64, 3))
    patch = np.clip(waves, 0, 1)
    noise = matched(patch, rng)
    assert noise.shape == patch.shape and noise.min() >= 0 and noise.max() <= 1
    np.testing.assert_allclose(noise.mean(axis=(0, 1)), patch.mean(axis=(0, 1)), atol=0.02)
    np.testing.assert_allclose(noise.std(axis=(0, 1)), patch.std(axis=(0, 1)), rtol=0.15)

    def roughness(image: Any) -> float:
        return float(np.abs(np.diff(image, axis=1)).mean())

    assert roughness(noise) == pytest.approx(roughness(patch), rel=0.35)
    assert abs(np.corrcoef(noise[..., 0].ravel(), patch[..., 0].ravel())[0, 1]) < 0.9
    save_file({"patch_0": patch.astype(np.float32)}, tmp_path / "patch.safetensors")
    contract = AttackContract()
    (made,) = control.build(ControlConfig(kind="matched", reference_patches=str(tmp_path))).optimise(
        contract.model(), contract.dataset(), TinyCompositor(contract.dataset()), budget=Budget(steps=1), rng=rng
    )
    assert made.rgb.shape == (32, 64, 3)


@pytest.mark.parametrize(
    "make",
    [
        lambda: EotConfig(share=0.0),
        lambda: EotConfig(min_scale=2.0),
        lambda: NesConfig(pairs=0),
        lambda: NesConfig(spread=0.0),
        lambda: SquareConfig(area=0.0),
        lambda: Rp2Config(base=2.0),
        lambda: Rp2Config(target="rode"),
        lambda: Rp2Config(source_class="car"),
        lambda: ThysConfig(batch=0),
        lambda: ControlConfig(kind="matched"),
        lambda: ControlConfig(rgb=(0.0, 0.0, 2.0)),
    ],
)
def test_bad_options_are_refused(make: Any) -> None:
    with pytest.raises(FieldError, match="must"):
        make()


@pytest.mark.parametrize("kind", [EotConfig, ThysConfig, Rp2Config])
def test_one_option_of_the_looks_leaves_the_others_as_they_were(kind: type[Any]) -> None:
    """And what is said of them is what they are."""
    usual = kind().appearance
    node = with_overrides(MappingNode({}, Place("none")), ["appearance.contrast=0.25"], kind)
    assert read_node(kind, node).appearance == dataclasses.replace(usual, contrast=0.25)
    said = {option["name"]: option["default"] for option in described(kind)}
    for name, value in dataclasses.asdict(usual).items():
        assert said[f"appearance.{name}"] == value


def test_classes_are_for_segmentation() -> None:
    class Depth(AttackContract):
        spec = rp2
        task = "depth"

    (sample, *_) = Depth().dataset()
    for options in ({"target": "road"}, {"source_class": "car", "target": "road"}):
        with pytest.raises(GearError, match="of the attack is for semantic segmentation"):
            Rp2(Rp2Config(**options)).objective(sample)


def test_the_papers_stereo_attack_leaves_classification_out() -> None:
    assert set(STEREO_LOSSES_LEFT_OUT) < set(LOSSES)
    assert all("class" in name for name in STEREO_LOSSES_LEFT_OUT)


@pytest.mark.parametrize(("task", "is_left_out"), [("stereo3d", True), ("detect2d", False)])
def test_the_papers_attack_leaves_losses_out_in_stereo_alone(
    task: str, is_left_out: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gear.plugins.attacks.carla_gear.task_of", lambda sample: task)
    objective = carla_gear.build(carla_gear.config()).objective(None)
    assert {objective.signs.get(name, 1.0) == 0 for name in STEREO_LOSSES_LEFT_OUT} == {is_left_out}


@pytest.mark.parametrize("arrays", [{}, {"bias": np.zeros(3, np.float32)}])
def test_matched_noise_is_not_made_of_any_safetensors(tmp_path: Path, arrays: Mapping[str, Any]) -> None:
    save_file(arrays, tmp_path / "patch.safetensors")
    with pytest.raises(GearError, match="holds something else than patches; name a folder that gear attack wrote"):
        read_exact(tmp_path)
