"""Options of the stereo networks, and the calibration that follows from them. The module does not import torch, so
plugin specs load quickly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gear.formats.kitti_object import Calibration
from gear.networks.options import NetworkOptions
from gear.values.errors import FieldError
from gear.values.geometry import Intrinsics

LEFT, RIGHT = "left", "right"

INPUT_SCALE = 0.5
"""Factor by which pictures are resized before the centre-based network if neither the user nor the weights state
one.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoOptions(NetworkOptions):
    """Parameters of the stereo cameras that the pictures themselves do not contain. The defaults are those of the
    task stereo3d. They include the options of `NetworkOptions`.

    Attributes:
        hfov_deg: horizontal field of view of the pictures, degrees.
        baseline_m: distance from the left to the right camera, metres.
    """

    hfov_deg: float = 90.0
    baseline_m: float = 0.54

    def __post_init__(self) -> None:
        if not 1 <= self.hfov_deg <= 170:
            raise FieldError("hfov_deg", f"must be 1 to 170 degrees, got {self.hfov_deg:g}")
        if not 0.01 <= self.baseline_m <= 10:
            raise FieldError("baseline_m", f"must be 0.01 to 10 m, got {self.baseline_m:g}")

    def calibration(self, size_px: tuple[int, ...]) -> Calibration:
        """Returns the calibration of a stereo pair with these options.

        Args:
            size_px: height and width of the pictures.
        """
        intrinsics = Intrinsics.from_hfov(size_px[1], size_px[0], math.radians(self.hfov_deg))
        return Calibration(intrinsics=intrinsics, baseline_m=self.baseline_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoCentreOptions(StereoOptions):
    """Options of the centre-based stereo network. They include the options of `StereoOptions`.

    Attributes:
        width: number of channels of the features that are matched, and of the ResNet's stem; the cost volume, the
            pyramid and the heads have multiples of it.
        input_scale: factor by which pictures are resized before the network. null takes the factor with which the
            weights were trained, or 0.5 if they state none.
        score_threshold: smallest score, 0..1, of a detection that is reported.
    """

    width: int = 32
    input_scale: float | None = None
    score_threshold: float = 0.02

    def __post_init__(self) -> None:
        StereoOptions.__post_init__(self)
        if self.width < 1:
            raise FieldError("width", f"must be at least 1, got {self.width}")
        if self.input_scale is not None and not 0.05 <= self.input_scale <= 2:
            raise FieldError("input_scale", f"must be 0.05 to 2, got {self.input_scale:g}")
        if not 0 <= self.score_threshold <= 1:
            raise FieldError("score_threshold", f"must be 0 to 1, got {self.score_threshold:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoRcnnOptions(StereoOptions):
    """Options of Stereo R-CNN. They include the options of `StereoOptions`.

    Attributes:
        short_side_px: the pictures are resized so that their shorter side has this many pixels.
        pre_nms_top_n: number of best-scored anchors from which proposals are made; twice as many in training.
        proposals: number of box pairs for the second stage.
        score_threshold: smallest score, 0..1, of a detection that is reported.
        refine_depth: whether depth is refined by dense photometric alignment. If not, it follows from the boxes and the
            keypoint.
        aligned_bias_px: value added to every aligned disparity. The authors add 0.5; by geometry it should be 0.
    """

    short_side_px: int = 600
    pre_nms_top_n: int = 6000
    proposals: int = 300
    score_threshold: float = 0.05
    refine_depth: bool = True
    aligned_bias_px: float = 0.0

    def __post_init__(self) -> None:
        StereoOptions.__post_init__(self)
        if not 32 <= self.short_side_px <= 4096:
            raise FieldError("short_side_px", f"must be 32 to 4096, got {self.short_side_px}")
        if not 1 <= self.proposals <= self.pre_nms_top_n:
            raise FieldError("proposals", f"must be 1 to pre_nms_top_n ({self.pre_nms_top_n}), got {self.proposals}")
        if not 0 <= self.score_threshold <= 1:
            raise FieldError("score_threshold", f"must be 0 to 1, got {self.score_threshold:g}")
