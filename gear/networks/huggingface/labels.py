"""Maps class names of other data sets to the class names of Cityscapes and COCO."""

from __future__ import annotations

import re
from collections.abc import Mapping

SYNONYMS = {
    "aeroplane": "airplane", "auto": "car", "automobile": "car", "bike": "bicycle",
    "diningtable": "dining table", "grass": "terrain", "hair dryer": "hair drier", "minibike": "motorcycle",
    "motorbike": "motorcycle", "pavement": "sidewalk", "pedestrian": "person", "plant": "vegetation",
    "pottedplant": "potted plant", "route": "road", "signboard": "traffic sign", "sofa": "couch", "tree": "vegetation",
    "tvmonitor": "tv", "van": "car",
}  # fmt: skip
"""Class names of Pascal VOC, ADE20K and similar data sets, and gear's names for the same classes; used for names
that gear does not know.
"""


def match(names: Mapping[int, str], class_ids: Mapping[str, int]) -> tuple[dict[int, int], tuple[str, ...]]:
    """Matches the classes of a network with gear's classes by name.

    A class may have several names, separated by commas or semicolons, as in ADE20K; the first name that gear knows is
    used.

    Args:
        names: class names of the network, by its class number.
        class_ids: gear's class numbers by name, in lower case.

    Returns:
        gear's class number for each matched class number of the network, and the unmatched names in the network's
        order.
    """
    found = {}
    for index, name in names.items():
        words = [word.strip().casefold().replace("_", " ") for word in re.split("[,;]", name)]
        numbers = [class_ids[word] for word in words if word in class_ids]
        numbers += [class_ids[SYNONYMS[word]] for word in words if SYNONYMS.get(word) in class_ids]
        if numbers:
            found[index] = numbers[0]
    return found, tuple(name for index, name in names.items() if index not in found)
