import dataclasses

import yaml

from gear.contracts.tasks import SplitInfo
from gear.formats.dataset_card import SplitFacts, card, size_category

INFO = SplitInfo(town="town10", scene="billboard01", split="val", seed=131, patch_label="none")
MANIFEST = {
    "weather": {"name": "ClearNoon"},
    "renderer": {"name": "classic"},
    "versions": {"gear": "0.1.0", "mujoco": "4.0.0"},
}


def test_the_front_matter_is_what_the_hub_reads() -> None:
    facts = SplitFacts.of(INFO, "semseg", 2, MANIFEST)
    configs = {"images": {"val": ["leftImg8bit/val/*.png"]}, "labels": {"val": ["a/*.png", "b/*.png"]}}
    text = card([facts], configs, "Trees of pictures.")
    _, front, body = text.split("---\n", 2)
    said = yaml.safe_load(front)
    assert said["license"] == "mit" and said["task_categories"] == ["image-segmentation"]
    assert said["size_categories"] == ["n<1K"] and said["annotations_creators"] == ["machine-generated"]
    assert said["configs"] == [
        {"config_name": "images", "default": True,
         "data_files": [{"split": "validation", "path": ["leftImg8bit/val/*.png"]}]},
        {"config_name": "labels", "data_files": [{"split": "validation", "path": ["a/*.png", "b/*.png"]}]},
    ]  # fmt: skip
    assert "| val | 2 | town10/billboard01 | ClearNoon | none | 131 |" in body
    assert "gear 0.1.0, MuJoCo 4.0.0, renderer classic" in body and "Trees of pictures." in body


def test_a_name_with_signs_of_yaml_is_a_name() -> None:
    facts = SplitFacts.of(dataclasses.replace(INFO, scene='a: "b" # c'), "depth", 1, {})
    front = yaml.safe_load(card([facts], {"x": {"val": ['a"b/*.png']}}, "").split("---\n")[1])
    assert front["pretty_name"] == 'gear depth town10 a: "b" # c, patch none'
    assert front["configs"][0]["data_files"][0]["path"] == ['a"b/*.png']


def test_no_two_splits_have_one_name_and_no_name_is_read_as_yaml() -> None:
    names = ("val", "validation", "on", 'a]\n  evil: "1"')
    facts = [SplitFacts.of(dataclasses.replace(INFO, split=name), "depth", 1, {}) for name in names]
    front = yaml.safe_load(card(facts, {"on": {name: ["a.png"] for name in names}}, "").split("---\n")[1])
    assert front["configs"][0]["config_name"] == "on"
    assert [one["split"] for one in front["configs"][0]["data_files"]] == list(names)


def test_what_a_manifest_lacks_is_unknown() -> None:
    facts = SplitFacts.of(INFO, "my_task", 0, {"weather": "odd"})
    assert (facts.weather, facts.gear, facts.samples) == ("unknown", "unknown", 0)
    assert "task_categories" not in card([facts], {}, "")


def test_sizes_are_the_hubs_classes() -> None:
    counts = (0, 999, 1000, 9_999, 10_000, 999_999, 1_000_000)
    assert [size_category(count) for count in counts] == [
        "n<1K", "n<1K", "1K<n<10K", "1K<n<10K", "10K<n<100K", "100K<n<1M", "n>1M",
    ]  # fmt: skip
