"""From masks with classes to a class a pixel.

Everything else, the folder, the image processor, the names of the classes, the loss, is gear's own adapter.
"""

from __future__ import annotations

from gear.nn.huggingface import FolderSegmenter
from torch import Tensor

LEAST = 1e-6
"""Added to a share of masks before its logarithm, where no mask says anything."""


class UniversalSegmenter(FolderSegmenter):
    """A network whose queries each say a mask and what it shows (Cheng et al., MaskFormer, 2021, section 3.4).

    A class counts in a pixel as much as the masks there that show it: the sum over queries of the class's probability
    times the mask's.
    """

    def their_logits(self, seen: Tensor) -> Tensor:
        """(B, classes, h, w): logarithms of those sums."""
        said = self.graph(pixel_values=seen)
        shows = said.class_queries_logits.softmax(-1)[..., :-1]  # the last one is "nothing"
        masks = said.masks_queries_logits.sigmoid()
        scores: Tensor = (shows.transpose(1, 2) @ masks.flatten(2)).unflatten(2, masks.shape[2:])
        return (scores + LEAST).log()
