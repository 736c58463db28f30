"""Weights of the networks of an ensemble, so that a patch is optimised for the network that it harms least.

A patch that harms every surrogate transfers better to a network that the attacker does not have (Liu et al., "Delving
into transferable adversarial examples and black-box attacks", ICLR 2017). With equal weights, an optimiser may spend
all effort on the weakest surrogate. Wang et al. ("Adversarial attack generation empowered by min-max optimization",
NeurIPS 2021) weight the surrogates so that the least harmed one counts most; a softmax is the smooth form of that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gear.contracts.attacks import Term


def balanced(by_member: Mapping[str, Mapping[str, Term]], focus: float) -> dict[str, Term]:
    """Returns the terms of all networks by name, with weights that favour the networks that are harmed least.

    Args:
        by_member: terms of the objective by name, for each network by the prefix of its names.
        focus: strength of the preference; 0 leaves all weights as they are.

    Returns:
        The terms, named `<prefix><name>`. The mean of the networks' factors is 1.
    """
    found = {prefix: sum(term.weight * float(term.value.detach()) for term in terms.values())
             for prefix, terms in by_member.items() if terms}  # fmt: skip
    factors = dict(zip(found, member_factors(list(found.values()), focus), strict=True))
    return {
        prefix + name: term if factors[prefix] == 1 else replace(term, weight=term.weight * factors[prefix])
        for prefix, terms in by_member.items()
        for name, term in terms.items()
    }


def member_factors(harms: list[float], focus: float) -> list[float]:
    """Returns the factor of each network: a softmax of minus its harm, times the number of networks.

    Args:
        harms: value of the objective for each network.
        focus: factor on the harms, which are divided by the mean of their sizes.
    """
    size = float(np.mean(np.abs(harms))) if harms else 0.0
    if focus == 0 or size == 0 or not np.isfinite(size):
        return [1.0] * len(harms)
    scaled = -focus * np.array(harms) / size
    weights = np.exp(scaled - scaled.max())
    return [float(weight) for weight in len(harms) * weights / weights.sum()]
