"""Patches without optimisation to compare attacks with: noise, one colour, or noise with a patch's statistics."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from gear.contracts.attacks import Budget, Compositor, Monitor, Patch, surface_of
from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import AttackSpec
from gear.values.errors import FieldError, GearError
from gear.values.regular_file import check_regular

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlConfig:
    """Options of the attack `control`, which makes patches without optimisation.

    Attributes:
        kind: `noise` draws every value uniformly; `solid` is one colour; `matched` is noise with the mean colour, the
            covariance of colours and the power spectrum of the patches in `reference_patches`.
        height_px, width_px: size of every patch, pixels; `matched` takes the size of the patches in
            `reference_patches`.
        rgb: colour for `solid`, sRGB in 0..1.
        reference_patches: folder of the patches that `matched` imitates, written by `gear attack`.
    """

    kind: Literal["noise", "solid", "matched"] = "noise"
    height_px: int = 150
    width_px: int = 300
    rgb: tuple[float, float, float] = (0.5, 0.5, 0.5)
    reference_patches: str = ""

    def __post_init__(self) -> None:
        for name in ("height_px", "width_px"):
            if not 2 <= getattr(self, name) <= 4096:
                raise FieldError(name, f"must be 2 to 4096, got {getattr(self, name)}")
        if not all(0 <= value <= 1 for value in self.rgb):
            raise FieldError("rgb", f"must be three numbers of 0 to 1, got {self.rgb}")
        if (self.kind == "matched") != bool(self.reference_patches):
            raise FieldError("reference_patches", "must name a patch folder for kind=matched, and only there")


class Control:
    """The attack `control`: makes patches without optimisation and never runs the model.

    Args:
        config: options of the attack.
    """

    def __init__(self, config: ControlConfig) -> None:
        self._config = config

    def read_sha256(self) -> str | None:
        """Returns the SHA-256 hash of the unrounded patches in the folder `reference_patches`, so that a run
        records what it read.

        The result is None if the option is not used.

        Raises:
            GearError: the folder has no file with unrounded patches.
        """
        if not self._config.reference_patches:
            return None
        return hashlib.sha256(
            b"".join(patch.tobytes() for patch in read_exact(Path(self._config.reference_patches)))
        ).hexdigest()

    def optimise(
        self,
        model: Model,
        dataset: Sequence[Any],
        compositor: Compositor,
        *,
        budget: Budget,
        rng: np.random.Generator,
        monitor: Monitor | None = None,
    ) -> tuple[Patch, ...]:
        """Makes one patch for each patch surface of the scene; the model and the budget are not used.

        Args:
            model: the attacked network.
            dataset: samples on which the patches are optimised.
            compositor: renderer of patches into the pictures of these samples.
            budget: number of steps, and of queries for black-box attacks.
            rng: random generator of the attack.
            monitor: receives the progress and the patches of each step; None for no monitor.

        Returns:
            Patches named `patch_0`, `patch_1`, …, in the order of the scene's surfaces.

        Raises:
            GearError: the folder `reference_patches` has fewer patches than the scene has surfaces, or no unrounded
                patches.
        """
        config, count = self._config, len(dataset[0].record.surfaces)
        size = (config.height_px, config.width_px, 3)
        if config.kind == "matched":
            originals = read_exact(Path(config.reference_patches))
            if len(originals) < count:
                raise GearError(
                    f"{config.reference_patches}: has {len(originals)} patches; the scene has {count} surfaces"
                )
            made = [matched(original, rng) for original in originals[:count]]
        elif config.kind == "solid":
            made = [np.broadcast_to(np.asarray(config.rgb), size) for _ in range(count)]
        else:
            made = [rng.uniform(0, 1, size) for _ in range(count)]
        return tuple(Patch(name=f"patch_{n}", rgb=np.array(rgb, np.float32, order="C")) for n, rgb in enumerate(made))


def matched(original: Floats, rng: np.random.Generator) -> Floats:
    """Random noise with the Fourier magnitudes, mean and standard deviation of a picture (Galerne et al., 2011).

    The random phases are the same for all channels, so colours vary together as in the picture. Values outside 0..1 are
    clipped, and mean and standard deviation are restored; this is repeated ten times.

    Args:
        original: (H, W, 3) picture in 0..1.
        rng: random generator of the phases.

    Returns:
        (H, W, 3) noise in 0..1.
    """
    phases = np.angle(np.fft.fft2(rng.standard_normal(original.shape[:2])))
    mean, spread = original.mean(axis=(0, 1)), original.std(axis=(0, 1))
    spectrum = np.fft.fft2(original - mean, axes=(0, 1)) * np.exp(1j * phases)[..., None]
    noise = np.real(np.fft.ifft2(spectrum, axes=(0, 1))) + mean
    for _ in range(10):
        noise = np.clip(noise, 0, 1)
        noise = (noise - noise.mean(axis=(0, 1))) * (spread / np.maximum(noise.std(axis=(0, 1)), 1e-9)) + mean
    return np.asarray(np.clip(noise, 0, 1))


def read_exact(folder: Path) -> list[Floats]:
    """Reads the unrounded patches from a folder that `gear attack` wrote: (H, W, 3) float64 in 0..1 each, in the
    order of the surfaces.

    Args:
        folder: the folder with the file `patch.safetensors`.

    Raises:
        GearError: the folder has no file with unrounded patches, or the file is damaged.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    path = folder / "patch.safetensors"
    if not path.is_file():
        raise GearError(f"{path}: there is no such file; name a folder that gear attack wrote")
    try:
        arrays = load_file(check_regular(path))
    except SafetensorError as error:
        raise GearError(f"{path}: not a safetensors file ({error})") from error
    if not arrays or any(array.ndim != 3 or array.shape[2] != 3 for array in arrays.values()):
        raise GearError(f"{path}: holds something else than patches; name a folder that gear attack wrote")
    return [arrays[name].astype(np.float64) for name in sorted(arrays, key=surface_of)]


control: AttackSpec[ControlConfig] = AttackSpec(
    name="control",
    summary="Patches without optimisation to compare attacks with: noise, one colour, or a patch's statistics.",
    config=ControlConfig,
    build=Control,
    needs_gradients=False,
    needs_probes=False,
    is_control=True,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[ControlConfig]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [control]
