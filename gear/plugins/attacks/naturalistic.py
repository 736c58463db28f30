"""The attack `naturalistic`: a patch with the spectrum and the colours of photographs.

Naturalistic patches are optimised in the latent space of a picture prior instead of in pixels, so that they do not
stand out as noise: Hu et al., "Naturalistic physical adversarial patch for object detectors", ICCV 2021, with the
latent vector of a pretrained generative network. gear takes a prior without a network
(`gear.plugins.attacks.optimisation.natural_prior`): bounded cosine coefficients with the amplitude spectrum, the colour
correlations and the contrast of photographs. The objectives are those of `scene_specific`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import AttackSpec
from gear.plugins.attacks.scene_specific import SceneSpecific, SceneSpecificConfig
from gear.values.errors import FieldError

if TYPE_CHECKING:
    from gear.plugins.attacks.optimisation.parametrisation import Parametrisation


@dataclass(frozen=True, slots=True, kw_only=True)
class NaturalisticConfig(SceneSpecificConfig):
    """Options of the attack `naturalistic`. They include the options of `SceneSpecificConfig`.

    Attributes:
        modes: half periods of the shortest wave along the patch's longer side. A patch of 150 x 300 pixels has
            about 1200 coefficients with the default, instead of 135,000 values.
        contrast: standard deviation of the patch's values, mean over the colour channels.
        slack: largest factor by which the amplitude of an octave of frequencies differs from the spectrum 1/f.
        learning_rate: peak learning rate of Adam on the coefficients, which have a standard deviation of 1; one number,
            or one each for brightness, blue-yellow and red-green. null takes the rates of `scene_specific`.
    """

    modes: int = 32
    contrast: float = 0.225
    slack: float = 1.25
    learning_rate: float | tuple[float, float, float] | None = 0.15
    smoothness: float = 0.0

    def __post_init__(self) -> None:
        SceneSpecificConfig.__post_init__(self)
        if not 2 <= self.modes <= 256:
            raise FieldError("modes", f"must be 2 to 256, got {self.modes}")
        if not 0 < self.contrast <= 0.5:
            raise FieldError("contrast", f"must be above 0, up to 0.5, got {self.contrast:g}")
        if not 1 <= self.slack <= 4:
            raise FieldError("slack", f"must be 1 to 4, got {self.slack:g}")


class Naturalistic(SceneSpecific):
    """The attack `naturalistic`: Adam on the coefficients of all surfaces' textures together.

    Args:
        config: options of the attack.
    """

    def __init__(self, config: NaturalisticConfig) -> None:
        SceneSpecific.__init__(self, config)
        self._prior_options = config

    def parametrisation(self) -> Parametrisation:
        """The natural prior, from whose coefficients textures are computed."""
        from gear.plugins.attacks.optimisation.natural_prior import NaturalPrior

        config = self._prior_options
        return NaturalPrior(
            config.height_px, config.width_px, modes=config.modes, contrast=config.contrast, slack=config.slack
        )


naturalistic: AttackSpec[NaturalisticConfig] = AttackSpec(
    name="naturalistic",
    summary="A patch with the spectrum and the colours of photographs: few coefficients instead of free pixels.",
    config=NaturalisticConfig,
    build=Naturalistic,
)


@hookimpl
def gear_attacks() -> list[AttackSpec[NaturalisticConfig]]:
    """Hook of the plugin system: returns the attack plugin that this module defines."""
    return [naturalistic]
