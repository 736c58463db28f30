"""What a record may hold: no paths, nothing enormous, nothing that contradicts itself."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from gear.leaderboard.field_checks import check_plain
from gear.leaderboard.record import Benchmark, Figure, digest
from gear.values.errors import FieldError
from tests.leaderboard.conftest import benchmark, plugin, record, sha


def test_a_sound_record_passes() -> None:
    one = record()
    assert one.kinds() == ("none", "random", "patch", "adaptive patch")
    found = one.figure("patch")
    assert found is not None and found.value == 0.6
    alone = one.figure("patch", is_reference=True)
    assert alone is not None and alone.value == 0.3
    assert one.figure("patch of other") is None


@pytest.mark.parametrize(
    "options",
    [
        {"weights": "/etc/passwd"}, {"weights": "..\\x"}, {"weights": "~root"}, {"a": [{"b": "x/y"}]}, {"a": 1e12},
        {"../up": 1}, {"a": "x" * 400}, {"plugin": "a/b/c"},
    ],
)  # fmt: skip
def test_paths_and_enormous_values_are_refused(options: Any) -> None:
    with pytest.raises(FieldError):
        plugin("net", options=options)


def test_plugins_of_packages_may_be_named() -> None:
    check_plain("config", {"models": {"net": {"plugin": "their-package/net"}}})


def test_deep_lists_are_refused() -> None:
    value: Any = 1
    for _ in range(20):
        value = [value]
    with pytest.raises(FieldError, match="levels"):
        check_plain("config", value)


def test_contradictions_are_refused() -> None:
    one = record()
    with pytest.raises(FieldError, match="cannot say that it was checked"):
        replace(one, checked_by=("myself",))
    with pytest.raises(FieldError, match="outside its interval"):
        Figure(patch="none", name="miou", value=0.9, low=0.1, high=0.2, n=4)
    with pytest.raises(FieldError, match="another number"):
        replace(one, results=(replace(one.results[0], n=400), *one.results[1:]))
    with pytest.raises(FieldError, match="figure twice"):
        replace(one, results=(*one.results, one.results[0]))
    with pytest.raises(FieldError, match="not listed"):
        replace(one, samples=(replace(one.samples[0], index=99),))
    for samples in (one.samples[1:], (*one.samples[1:], one.samples[1]), (*one.samples, one.samples[0]), ()):
        with pytest.raises(FieldError, match="every sample of every dataset exactly once"):
            replace(one, samples=samples)
    with pytest.raises(FieldError, match="hash of the config"):
        Benchmark(name="x", config={"seed": 1}, sha256=digest({"seed": 2}))
    with pytest.raises(FieldError, match="kind"):
        replace(one, entry=replace(one.entry, kind="model"))


def test_comparable_benchmarks_have_one_key() -> None:
    assert benchmark().data_key == benchmark(seed=4, attack={"steps": 9}).data_key
    assert benchmark().data_key != benchmark(samples={"measure": 400}).data_key


def test_kinds_of_patches_are_limited() -> None:
    with pytest.raises(FieldError, match="more than 64 kinds of patches"):
        record({f"patch of net{number}": 0.5 for number in range(65)}, results=())
    assert len(record({f"patch of net{number}": 0.5 for number in range(64)}).kinds()) == 64


def test_other_weights_are_another_row() -> None:
    one, other = (record(entry={"network": plugin("net", weights_sha256=sha(name))}) for name in ("a", "b"))
    assert one.entry.row != other.entry.row
    guard = plugin("guard", weights_sha256=sha("a"))
    assert record(entry={"defense": guard}).entry.row != record().entry.row
