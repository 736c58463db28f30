from __future__ import annotations

from typing import ClassVar

from gear.plugins.controllers import blind, depth, detect2d, semseg, stereo3d, truth
from gear.testing.controller_contract import ControllerContract


class TestBlind(ControllerContract):
    spec = blind.spec


class TestTruth(ControllerContract):
    spec = truth.spec


class TestDetect2d(ControllerContract):
    spec = detect2d.spec
    options: ClassVar = {"min_score": 0.7}


class TestStereo3d(ControllerContract):
    spec = stereo3d.spec


class TestDepth(ControllerContract):
    spec = depth.spec
    options: ClassVar = {"percentile": 10.0, "emergency_ttc_s": 2.0}


class TestSemseg(ControllerContract):
    spec = semseg.spec
