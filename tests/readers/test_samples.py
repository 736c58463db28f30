"""The samples of several splits as one sequence."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from gear.readers.samples import Samples, all_of


class Split(list[str]):
    """A split of texts."""

    def __init__(self, name: str, count: int) -> None:
        super().__init__(f"{name}{number}" for number in range(count))
        info = SimpleNamespace(town="t", scene=name, split="train", seed=4, patch_label="none")
        self.plan = SimpleNamespace(info=info, content_key=f"key-{name}")

    def named(self, key: str) -> str:
        return f"{key} of {self.plan.info.scene}"


def splits() -> Any:
    return Split("a", 2), Split("b", 3)


def test_samples_follow_the_order_of_the_splits() -> None:
    samples = all_of(splits())
    assert len(samples) == 5
    assert list(samples) == ["a0", "a1", "b0", "b1", "b2"]
    assert samples[-1] == "b2"
    part = samples[1:4]
    assert isinstance(part, Samples)
    assert list(part) == ["a1", "b0", "b1"]


def test_facts_count_the_chosen_samples_of_each_split() -> None:
    facts: Any = all_of(splits())[2:4].facts()
    assert [(fact["scene"], fact["samples"], fact["content"]) for fact in facts] == [("t/b", 2, "key-b")]
    assert facts[0]["weather"] == "weather of b"
    both: Any = all_of(splits()).facts()
    assert [fact["samples"] for fact in both] == [2, 3]
