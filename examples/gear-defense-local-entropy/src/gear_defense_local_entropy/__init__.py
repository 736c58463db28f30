"""local_entropy: finds patches by their local entropy, after Jedi (Tarchoun et al., CVPR 2023)."""

from __future__ import annotations

from dataclasses import dataclass

from gear.contracts.defenses import Defense
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.values.errors import FieldError

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalEntropyConfig:
    """Options of local_entropy. The defaults are the paper's, measured on photographs, for its three window sizes.

    Attributes:
        patch_mean, patch_std: entropy of patches in bits, for the small, middle and large windows.
        clean_mean, clean_std: the same of clean pictures.
        least_share: blobs below this share of the picture are dropped, if there are larger ones.
        grow_px: radius by which the mask is closed and dilated.
    """

    patch_mean: Triple = (5.32, 6.06, 6.47)
    patch_std: Triple = (0.32, 0.34, 0.35)
    clean_mean: Triple = (2.75, 3.19, 3.47)
    clean_std: Triple = (1.16, 1.13, 1.07)
    least_share: float = 0.005
    grow_px: int = 3

    def __post_init__(self) -> None:
        if not 0 <= self.least_share < 1:
            raise FieldError("least_share", f"must be 0 or more and below 1, got {self.least_share:g}")
        if not 0 <= self.grow_px <= 100:
            raise FieldError("grow_px", f"must be 0 to 100, got {self.grow_px}")
        for name in ("patch_mean", "patch_std", "clean_std"):
            if min(getattr(self, name)) <= 0:
                raise FieldError(name, f"must be above 0, got {getattr(self, name)}")


def build(config: LocalEntropyConfig) -> Defense:
    """Imports OpenCV when the defense is asked for."""
    from gear_defense_local_entropy.local_entropy import LocalEntropy

    return LocalEntropy(config)


spec = DefenseSpec(
    name="local_entropy",
    summary="Finds patches by local entropy at three scales and fills them in.",
    config=LocalEntropyConfig,
    build=build,
    outputs=frozenset({"images", "mask", "score"}),
    gradient="none",
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[LocalEntropyConfig]]:
    """Called by gear, which finds this module through the entry point in pyproject.toml."""
    return [spec]
