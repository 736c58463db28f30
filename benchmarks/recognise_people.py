"""Whether a network that has only ever seen photographs finds the people in gear's pictures.

    python benchmarks/recognise.py data/detect2d … --people crops
    python -m venv pose && pose/bin/pip install "mediapipe<0.10.22"
    pose/bin/python benchmarks/recognise_people.py crops

MediaPipe's pose network comes with its weights in the package, which wants older libraries than gear's, hence an
environment of its own. Asked are crops in which a person fills four fifths of the height, and crops of the same places'
sizes where nobody stands. Printed is in how many it finds a body, and in how many one whose head and feet are where the
person's are, to a tenth of the crop's height.
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np

HEAD, FEET = slice(0, 11), slice(27, 33)
"""The network's landmarks of the face, and of both feet."""

HEAD_AT, FEET_AT = 0.16, 0.87
"""Where these are in a crop, as shares of its height: the person's box begins at 0.1 and ends at 0.9."""


def main() -> None:
    """Prints one line for the crops with people, and one for the crops without."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("crops", type=Path, metavar="CROPS", help="folder that recognise.py --people wrote")
    crops = parser.parse_args().crops
    mediapipe: Any = importlib.import_module("mediapipe")
    pose = mediapipe.solutions.pose.Pose(static_image_mode=True, model_complexity=1)
    print(f"{'crops of':10}{'crops':>7}{'found':>8}{'in place':>10}")
    for name in ("people", "nobody"):
        found, in_place = [], []
        for path in sorted((crops / name).glob("*.png")):
            marks = pose.process(np.ascontiguousarray(np.asarray(cv2.imread(str(path)))[..., ::-1])).pose_landmarks
            found.append(marks is not None)
            heights = np.array([mark.y for mark in marks.landmark]) if marks else np.full(33, np.nan)
            in_place.append(abs(heights[HEAD].mean() - HEAD_AT) < 0.1 and abs(heights[FEET].mean() - FEET_AT) < 0.1)
        print(f"{name:10}{len(found):7}{np.mean(found):8.2f}{np.mean(in_place):10.2f}")


if __name__ == "__main__":
    main()
