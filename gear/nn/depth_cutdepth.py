"""Vertical CutDepth (Kim et al., GLPDepth, arXiv 2201.07436, section 3.4): strips of the picture become its depth."""

from __future__ import annotations

import numpy as np

from gear.values.frames import FloatImage, UInt8Image


def vertical_cutdepth(
    picture: UInt8Image,
    depth_m: FloatImage,
    rng: np.random.Generator,
    *,
    probability: float = 0.25,
    widest: float = 0.75,
    max_depth_m: float = 80.0,
) -> UInt8Image:
    """Replaces a strip of full height by the ground truth as a grey level, which teaches a network to look at edges.

    The strip begins at column a*W and is max((W - a*W) * b * widest, 1) columns wide, a and b uniform in 0..1: the
    paper's l and w. The picture is changed, never the ground truth. The paper does not say how metres become grey
    levels; here 0..`max_depth_m` are 0..255, and pixels without ground truth keep their colour.

    Args:
        picture: (H, W, 3) uint8.
        depth_m: (H, W) float32, NaN where unknown.
        rng: draws three numbers whatever happens, so that what is drawn next does not depend on the outcome.
        probability: of being applied; one in four in the authors' training.
        widest: share of what lies right of a*W (the paper's p, 0.75).
        max_depth_m: white.

    Returns:
        A new picture, or the same one where nothing is replaced.
    """
    chance, start, share = rng.random(3)
    if chance >= probability:
        return picture
    width = picture.shape[1]
    left = int(start * width)
    strip = slice(left, left + max(int((width - left) * share * widest), 1))
    metres = depth_m[:, strip, None]
    grey = np.rint(np.clip(np.nan_to_num(metres), 0, max_depth_m) / max_depth_m * 255).astype(np.uint8)
    changed = picture.copy()
    changed[:, strip] = np.where(np.isfinite(metres), grey, picture[:, strip])
    return changed
