"""The contract of defenses (what every defense plugin promises), as tests.

Subclass it in your plugin's tests and set `spec`:

    class TestMedian(DefenseContract):
        spec = median
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest

from gear.config.dump import to_yaml
from gear.config.nodes import parse_text
from gear.config.reader import read_node
from gear.contracts.defenses import Defense, DefenseResult, FittedDefense
from gear.contracts.models import Model
from gear.contracts.specs import DefenseSpec
from gear.plugins.spec_validation import spec_problem
from gear.values.frames import UInt8Image
from gear.values.rng import derive_rng

SEED = 7


def street_picture(width_px: int, height_px: int, seed: int) -> UInt8Image:
    """A (H, W, 3) uint8 picture of a simple street: sky, road, and six rectangles as buildings.

    Args:
        width_px, height_px: size of the picture.
        seed: seed of colours and buildings.
    """
    rng = derive_rng(SEED, "picture", seed)
    rows = np.linspace(0, 1, height_px)[:, None, None]
    columns = np.linspace(0, 1, width_px)[None, :, None]
    sky, road = np.array([150.0, 180.0, 220.0]), np.array([70.0, 72.0, 75.0])
    picture = np.where(rows < 0.5, sky - 60 * rows, road + 30 * (rows - 0.5)) + 12 * np.sin(columns * 6 + seed)
    for _ in range(6):
        left, top = int(rng.integers(0, width_px * 3 // 4)), int(rng.integers(height_px // 5, height_px // 2))
        picture[top : top + height_px // 4, left : left + width_px // 6] = rng.uniform(40, 200, 3)
    street: UInt8Image = np.clip(picture, 0, 255).astype(np.uint8)
    return street


def noisy_patch(picture: UInt8Image, seed: int) -> tuple[UInt8Image, np.ndarray]:
    """Covers a fixed rectangle of a picture with strong noise.

    Args:
        picture: (H, W, 3) uint8; it is not changed.
        seed: seed of the noise.

    Returns:
        The new picture, and the (H, W) bool mask of the rectangle.
    """
    height, width = picture.shape[:2]
    area = np.zeros((height, width), np.bool_)
    area[height // 4 : height // 2, width // 3 : width * 3 // 4] = True
    noise = derive_rng(SEED, "patch", seed).integers(0, 256, picture.shape, dtype=np.uint8)
    return np.where(area[..., None], noise, picture), area


class DefenseContract:
    """The promises of a defense plugin, as tests. A plugin's test file subclasses it and sets `spec`.

    Attributes:
        spec: the defense's spec.
        options: options of the defense's config.
        views: names of the cameras whose pictures the defense receives.
        size_px: width and height of the pictures.
    """

    spec: ClassVar[DefenseSpec[Any]]
    options: ClassVar[Mapping[str, Any]] = {}
    views: ClassVar[tuple[str, ...]] = ("left", "right")
    size_px: ClassVar[tuple[int, int]] = (128, 72)

    def model(self) -> Model | None:
        """The model that the defense protects; override it for defenses that need a model."""
        return None

    def make(self) -> Defense:
        """Builds a new defense from the spec and the options."""
        return self.spec.build(self.spec.config(**self.options))

    def pictures(self, seed: int = 0, *, is_patched: bool = True) -> dict[str, UInt8Image]:
        """The (H, W, 3) uint8 pictures of one sample by camera name, with or without noise patches.

        Args:
            seed: seed of the pictures.
            is_patched: whether the pictures contain noise patches.
        """
        plain = {name: street_picture(*self.size_px, seed * 10 + i) for i, name in enumerate(self.views)}
        return {name: noisy_patch(p, seed)[0] for name, p in plain.items()} if is_patched else plain

    def state(self, defense: Defense) -> Any:
        """The state that `fit` returns for four clean and four patched samples.

        Args:
            defense: the defense.
        """
        clean = [self.pictures(i, is_patched=False) for i in range(4)]
        patched = [self.pictures(i) for i in range(4)]
        return defense.fit(clean, patched, self.model(), derive_rng(SEED, "fit"))

    def result(self, pictures: Mapping[str, UInt8Image], seed: int = SEED) -> DefenseResult:
        """The result of a new, calibrated defense for one sample.

        Args:
            pictures: (H, W, 3) uint8 pictures by camera name.
            seed: seed of the defense.
        """
        defense = self.make()
        return defense.apply(pictures, self.model(), self.state(defense), derive_rng(seed, "apply"))

    def test_the_spec_can_be_used(self) -> None:
        """Name, protocol, config and build of the spec are valid."""
        assert spec_problem("defense", self.spec) is None

    def test_the_config_survives_yaml(self) -> None:
        """A config that is written as YAML and read again is equal to the original."""
        config = self.spec.config(**self.options)
        assert read_node(self.spec.config, parse_text(to_yaml(config), "config")) == config
        assert dataclasses.replace(config) == config

    def test_pictures_keep_shape_and_type(self) -> None:
        """The result has a uint8 picture of the same shape for every camera."""
        pictures = self.pictures()
        result = self.result(pictures)
        assert isinstance(result, DefenseResult)
        assert set(result.views) == set(pictures)
        for name, picture in result.views.items():
            assert picture.shape == pictures[name].shape
            assert picture.dtype == np.uint8

    def test_it_leaves_its_input_alone(self) -> None:
        """The defense works on read-only pictures; a returned picture is the same array or shares no memory with it."""
        pictures = self.pictures()
        for picture in pictures.values():
            picture.setflags(write=False)
        result = self.result(pictures)
        for name, picture in result.views.items():
            assert picture is pictures[name] or not np.shares_memory(picture, pictures[name])

    def test_the_same_generator_gives_the_same_result(self) -> None:
        """Two runs with equal random generators give equal pictures, masks and scores."""
        first, second = self.result(self.pictures()), self.result(self.pictures())
        for name in self.views:
            assert np.array_equal(first.views[name], second.views[name])
            if first.mask is not None and second.mask is not None:
                assert np.array_equal(first.mask[name], second.mask[name])
        assert first.score == second.score

    def test_outputs_are_what_the_spec_declares(self) -> None:
        """Masks (one per camera) and scores are returned if and only if the spec declares them; values are in 0..1."""
        result = self.result(self.pictures())
        assert (result.mask is not None) == ("mask" in self.spec.outputs)
        assert (result.score is not None) == ("score" in self.spec.outputs)
        assert result.mask is None or set(result.mask) == set(self.views)
        for name, mask in (result.mask or {}).items():
            assert mask.shape == result.views[name].shape[:2]
            assert mask.dtype == np.float32
            assert 0 <= float(mask.min()) <= float(mask.max()) <= 1
        assert result.score is None or (isinstance(result.score, (int, float)) and 0 <= result.score <= 1)

    def test_samples_do_not_touch_each_other(self) -> None:
        """The result for a sample does not depend on samples that were processed earlier."""
        defense = self.make()
        state = self.state(defense)
        alone = defense.apply(self.pictures(1), self.model(), state, derive_rng(SEED, "apply"))
        defense.apply(self.pictures(2), self.model(), state, derive_rng(SEED, "other"))
        again = defense.apply(self.pictures(1), self.model(), state, derive_rng(SEED, "apply"))
        for name in self.views:
            assert np.array_equal(alone.views[name], again.views[name])
            if alone.mask is not None and again.mask is not None:
                assert np.array_equal(alone.mask[name], again.mask[name])
        assert alone.score == again.score

    def test_a_wrapped_model_is_a_model(self) -> None:
        """`wrap` returns an object with the methods of a model: `predict`, `forward` and `taps`."""
        pytest.importorskip("torch", reason="models need torch")
        from gear.testing.tiny_networks import TinyConfig, TinySegmenter

        wrapped = self.make().wrap(self.model() or TinySegmenter(TinyConfig()))
        assert all(callable(getattr(wrapped, name, None)) for name in ("predict", "forward", "taps"))

    def test_gradients_pass_as_declared(self) -> None:
        """`forward` agrees with `apply`, does not depend on the batch, and passes a gradient to every picture.

        A defense that declares no gradient raises ValueError instead.
        """
        torch = pytest.importorskip("torch", reason="gradients need torch")
        defense = self.make()
        pictures = [self.pictures(i) for i in range(2)]

        def batch(samples: list[dict[str, UInt8Image]]) -> dict[str, Any]:
            return {
                name: torch.from_numpy(np.stack([s[name] for s in samples])).permute(0, 3, 1, 2).float() / 255
                for name in self.views
            }

        if self.spec.gradient == "none":
            with pytest.raises(ValueError, match=r"\S"):
                defense.forward(batch(pictures))
            return
        state = self.state(defense)

        def forward(views: dict[str, Any]) -> Any:
            model = self.model()
            if isinstance(defense, FittedDefense) and model is not None:
                return defense.forward_fitted(views, model, state)
            return defense.forward(views)

        both, one = batch(pictures), forward(batch(pictures[:1]))
        for tensor in both.values():
            tensor.requires_grad_(True)
        cleaned = forward(both)
        for name in self.views:
            assert torch.allclose(cleaned[name][:1], one[name], atol=1e-5)
            assert cleaned[name].shape == both[name].shape
            for i, sample in enumerate(pictures):
                expected = defense.apply(sample, self.model(), state, derive_rng(SEED, "apply")).views[name]
                got = cleaned[name][i].detach().permute(1, 2, 0).numpy() * 255
                assert np.quantile(np.abs(got - expected), 0.99) <= 1.0
        torch.stack([tensor.square().sum() for tensor in cleaned.values()]).sum().backward()
        for tensor in both.values():
            assert tensor.grad is not None
            assert bool(torch.isfinite(tensor.grad).all())
            assert float(tensor.grad.abs().sum()) > 0
