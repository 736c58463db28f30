from __future__ import annotations

from typing import Any, ClassVar

from gear.plugins.models.retinanet_r18_fpn import CATEGORIES, retinanet_lite0, retinanet_r18
from gear.testing.model_contract import ModelContract
from gear.values.labels import LABELS
from tests.networks.detector_samples import SMALL

OPTIONS: dict[str, Any] = {"weights": "none", "device": "cpu", "score_threshold": 0.01}


class TestRetinaNetR18(ModelContract):
    spec = retinanet_r18
    options: ClassVar[dict[str, Any]] = OPTIONS
    task_options = SMALL


class TestRetinaNetLite0(ModelContract):
    spec = retinanet_lite0
    options: ClassVar[dict[str, Any]] = OPTIONS
    task_options = SMALL


def test_there_is_a_class_for_everything_in_the_towns() -> None:
    assert set(CATEGORIES) == {label.coco_id for label in LABELS} - {None}
