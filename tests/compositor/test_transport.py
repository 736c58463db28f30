"""Composed pictures against rendered ones, on the tiny town."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy import sparse

import gear
from gear.camera.response import IDENTITY, Response
from gear.compositor.homography import HomographyCompositor
from gear.compositor.registry import open_compositor
from gear.compositor.sparse import SparseMatrix
from gear.compositor.transport import TransportCompositor, _Light
from gear.dataset.probe_files import probes_of
from gear.values.errors import DatasetError, UnknownNameError
from gear.values.frames import LINEAR_FULL_SCALE

from .conftest import MakeTwins, gaps, random_patches

EXACT_DB = 40.0


@pytest.mark.parametrize(
    ("scene", "renderer", "quality", "task"),
    [
        ("board", "classic", "fast", "semseg"),
        ("board", "classic", "film", "semseg"),
        ("double", "classic", "fast", "semseg"),
        ("truck", "classic", "fast", "stereo3d"),
        ("board", "raster", "fast", "semseg"),
        ("double", "raster", "film", "semseg"),
        ("truck", "raster", "film", "stereo3d"),
        pytest.param("board", "filament", "fast", "semseg", marks=pytest.mark.slow),
        pytest.param("double", "filament", "film", "semseg", marks=pytest.mark.slow),
        pytest.param("truck", "filament", "film", "stereo3d", marks=pytest.mark.slow),
    ],
)
def test_composed_and_rendered_pictures_are_the_same(
    twins: MakeTwins, scene: str, renderer: str, quality: str, task: str
) -> None:
    clean, twin = twins(scene, renderer, quality, task)
    found = gaps(TransportCompositor(clean, rounding=True), twin)
    assert found
    assert np.median([gap.psnr_db for gap in found]) >= EXACT_DB
    pasted = gaps(HomographyCompositor(clean, rounding=True), twin)
    assert np.median([gap.psnr_db for gap in pasted]) < np.median([gap.psnr_db for gap in found]) - 6


@pytest.mark.parametrize(
    "setting",
    [
        ("camera.vignette=0.4",),
        ("camera.shot_noise=1.5", "camera.read_noise=0.3"),
        ("camera.lens.k1=-0.12",),
        ("camera.shutter_s=0.02",),
        ("options.roll_deg=12", "options.principal_px=[150,70]", "options.focal_px=170", "options.focal_y_px=150"),
        ("options.principal_px=[150,70]", "options.focal_y_px=150", "camera.lens.k1=-0.1", "camera.shutter_s=0.02"),
        ("weather=HardRainNoon",),
        ("weather=WetNoon",),
    ],
)
def test_what_weather_and_camera_add_is_in_the_composed_picture(twins: MakeTwins, setting: tuple[str, ...]) -> None:
    clean, twin = twins(settings=setting)
    found = gaps(TransportCompositor(clean, rounding=True), twin)
    assert np.median([gap.psnr_db for gap in found]) >= EXACT_DB


@pytest.mark.parametrize("renderer", ["classic", "raster", pytest.param("filament", marks=pytest.mark.slow)])
@pytest.mark.parametrize("quality", ["fast", "film"])
def test_a_low_sun_full_on_the_board_makes_white_brighter_than_a_frame_can_be(
    twins: MakeTwins, renderer: str, quality: str
) -> None:
    clean, twin = twins("board", renderer, quality, "semseg", ("weather=CloudySunset", "weather.sun_azimuth_deg=175"))
    whites = [probe.white.max() for index in range(len(clean)) for probe in probes_of(clean, index, "left")]
    assert max(whites) > LINEAR_FULL_SCALE
    found = gaps(TransportCompositor(clean, rounding=True), twin)
    assert np.median([gap.psnr_db for gap in found]) >= EXACT_DB


def test_pixels_that_no_surface_reaches_are_the_datasets_own(twins: MakeTwins) -> None:
    clean, _ = twins()
    composed = TransportCompositor(clean).compose(random_patches(1), [0, 1], "left")
    for index in (0, 1):
        (probe,) = probes_of(clean, index, "left")
        stored = torch.from_numpy(clean[index].images["left"].copy()).permute(2, 0, 1).float() / 255
        outside = torch.ones(stored.shape[1:], dtype=torch.bool)
        height, width = probe.black.shape[:2]
        outside[probe.top_px : probe.top_px + height, probe.left_px : probe.left_px + width] = False
        assert bool(outside.any())
        assert torch.equal(composed[index][:, outside], stored[:, outside])
        assert not torch.equal(composed[index][:, ~outside], stored[:, ~outside])


def test_gradients_are_those_of_finite_differences(twins: MakeTwins) -> None:
    clean, _ = twins("double")
    compositor = TransportCompositor(clean)
    patches = [torch.full((3, 6, 12), 0.4 + 0.1 * n, requires_grad=True) for n in range(2)]
    weights = torch.linspace(0, 1, 320)

    def score(values: list[torch.Tensor]) -> torch.Tensor:
        return (compositor.compose(values, [0, 1], "left").double() * weights).sum()

    score(patches).backward()
    for n, patch in enumerate(patches):
        gradient = patch.grad
        assert gradient is not None and bool((gradient != 0).any())
        place = (1, 3, 7)
        step = 0.02
        moved = [[p.detach().clone() for p in patches] for _ in range(2)]
        moved[0][n][place] += step
        moved[1][n][place] -= step
        slope = (score(moved[0]) - score(moved[1])) / (2 * step)
        assert float(gradient[place]) == pytest.approx(float(slope), rel=0.02)


def test_one_patch_a_sample_is_the_same_as_one_at_a_time(twins: MakeTwins) -> None:
    clean, _ = twins()
    compositor = TransportCompositor(clean)
    both = torch.rand((2, 3, 20, 40), generator=torch.Generator().manual_seed(3))
    together = compositor.compose([both], [0, 1], "left")
    for index in (0, 1):
        alone = compositor.compose([both[index]], [index], "left")[0]
        assert torch.allclose(together[index], alone, atol=1e-6)


def test_the_same_call_gives_the_same_bits_and_the_cache_changes_nothing(twins: MakeTwins) -> None:
    clean, _ = twins()
    patches = random_patches(1)
    first = TransportCompositor(clean).compose(patches, [0, 1], "left")
    forgetful = TransportCompositor(clean, cache_bytes=0)
    assert torch.equal(first, forgetful.compose(patches, [0, 1], "left"))
    assert torch.equal(first, forgetful.compose(patches, [0, 1], "left"))


def test_rounding_gives_bytes_and_lets_gradients_pass(twins: MakeTwins) -> None:
    clean, _ = twins()
    patch = torch.full((3, 15, 30), 0.5001, requires_grad=True)
    composed = TransportCompositor(clean, rounding=True).compose([patch], [0], "left")
    assert torch.allclose(composed * 255, torch.round(composed * 255), atol=1e-3)
    composed.sum().backward()
    assert patch.grad is not None and bool((patch.grad > 0).any())


def test_wrong_patches_are_refused(twins: MakeTwins) -> None:
    clean, _ = twins("double")
    compositor = TransportCompositor(clean)
    with pytest.raises(ValueError, match="2 surfaces, got 1"):
        compositor.compose(random_patches(1), [0], "left")
    with pytest.raises(ValueError, match="a patch must be"):
        compositor.compose([torch.zeros(4, 10, 20)] * 2, [0], "left")
    with pytest.raises(DatasetError, match="no view 'rear'"):
        compositor.compose(random_patches(2), [0], "rear")


def test_a_dataset_without_probes_is_refused_and_says_what_to_do(twins: MakeTwins) -> None:
    _, twin = twins()
    with pytest.raises(DatasetError, match="--probes"):
        TransportCompositor(twin).compose(random_patches(1), [0], "left")
    assert HomographyCompositor(twin).compose(random_patches(1), [0], "left").shape == (1, 3, 160, 320)


def test_compositors_have_names(twins: MakeTwins) -> None:
    clean, _ = twins()
    assert isinstance(open_compositor("transport", clean), TransportCompositor)
    assert isinstance(open_compositor("homography", clean), HomographyCompositor)
    with pytest.raises(UnknownNameError, match="transport"):
        open_compositor("transprt", clean)


def test_a_broken_probe_is_named(twins: MakeTwins, tmp_path: Path) -> None:
    clean, _ = twins()
    for name, data in ((p.relative_to(clean.root), p.read_bytes()) for p in clean.root.rglob("*") if p.is_file()):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"" if name.name.endswith("white.png") else data)
    broken = replace(gear.open_dataset(tmp_path), root=tmp_path)
    with pytest.raises(DatasetError, match=r"white\.png"):
        probes_of(broken, 0, "left")


def test_light_of_all_surfaces_is_added_and_each_view_has_its_own_camera() -> None:
    """Two views of two and one pixels, two surfaces: picture = response(effects(B + M_1 p_1 G_1 + M_2 p_2 G_2))."""
    rng = np.random.default_rng(0)
    counts, texels = (2, 1), (3, 4)
    dense = [[rng.uniform(0, 0.2, (count, each)).astype(np.float32) for each in texels] for count in counts]
    black = [rng.uniform(0, 0.1, (count, 3)).astype(np.float32) for count in counts]
    gains = [[rng.uniform(0, 1, (count, 3)).astype(np.float32) for _ in texels] for count in counts]
    patches = [rng.uniform(0, 1, (each, 3)).astype(np.float32) for each in texels]
    responses = (Response(exposure=1.5, contrast=1.2), IDENTITY)
    effects = ((), (lambda light: light * 0.5, lambda light: light + 0.1))
    inner = [
        _Light(
            black=torch.from_numpy(black[view]),
            matrices=tuple(SparseMatrix.of(sparse.csr_matrix(m), torch.device("cpu")) for m in dense[view]),
            gains=tuple(torch.from_numpy(gain) for gain in gains[view]),
            response=responses[view],
            effects=effects[view],
        )
        for view in range(2)
    ]
    shown = TransportCompositor([])._composed(inner, [torch.from_numpy(p) for p in patches])  # type: ignore[arg-type]
    light = [
        black[view] + sum(m @ p * gain for m, p, gain in zip(dense[view], patches, gains[view], strict=True))
        for view in range(2)
    ]
    wanted = np.concatenate([responses[0].curve(light[0]), light[1] * 0.5 + 0.1])
    assert shown.numpy() == pytest.approx(wanted, abs=1e-6)
    for view, one in enumerate(inner):
        assert one.nbytes == black[view].nbytes + sum(
            matrix.nbytes + gain.nbytes for matrix, gain in zip(one.matrices, gains[view], strict=True)
        )
