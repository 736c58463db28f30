"""Options of Z-Mask."""

from __future__ import annotations

from dataclasses import dataclass

from gear.plugins.defenses.activations.options import AlarmConfig
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class ZMaskConfig(AlarmConfig):
    """Options, with the values of the authors' demonstration (BiSeNet, pictures of 2048 x 1024).

    Attributes:
        shallow, deep: feature maps of the model to look at; empty takes the paper's of networks that it names, of
            others the first (shallow) and the first and the last (deep).
        rows: of the grid on which activations are compared.
        shallow_kernels, deep_kernels: rows of the pooling windows, large ones first; they are twice as wide.
        statistics_pictures: clean pictures of which what is usual is learnt, at most.
        learning_pictures: pictures with patches from which the mask is learnt, at most.
        steps: of the training on these; 250 passes over 100 pictures, 15 a step, were published.
        only_if_sure: whether to leave alone what scores less than 0.5.
    """

    shallow: tuple[str, ...] = ()
    deep: tuple[str, ...] = ()
    rows: int = 150
    shallow_kernels: tuple[int, ...] = (64, 32, 16, 8)
    deep_kernels: tuple[int, ...] = (64, 32)
    statistics_pictures: int = 500
    learning_pictures: int = 50
    steps: int = 1750
    only_if_sure: bool = False

    def __post_init__(self) -> None:
        AlarmConfig.__post_init__(self)
        for name in ("rows", "statistics_pictures", "learning_pictures", "steps"):
            if getattr(self, name) < 1:
                raise FieldError(name, f"must be at least 1, got {getattr(self, name)}")
        for name in ("shallow_kernels", "deep_kernels"):
            kernels = getattr(self, name)
            if not kernels or min(kernels) < 1 or max(kernels) > self.rows:
                raise FieldError(name, f"must be one or more numbers from 1 to rows ({self.rows}), got {list(kernels)}")
