from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gear.config.dump import to_plain, to_yaml
from gear.config.nodes import parse_file, parse_text
from gear.config.overrides import with_overrides
from gear.config.reader import WHOLE, read_node
from gear.values.errors import ConfigError, FieldError


@dataclass(frozen=True, kw_only=True)
class Lens:
    baseline_m: float = 0.54
    size_px: tuple[int, int] = (1224, 370)

    def __post_init__(self) -> None:
        if self.baseline_m <= 0:
            raise FieldError("baseline_m", "must be > 0")


@dataclass(frozen=True, kw_only=True)
class Run:
    name: str
    mode: Literal["film", "fast"] = "film"
    is_wet: bool = False
    note: str | None = None
    lens: Lens = field(default_factory=Lens)
    counts: dict[str, int] = field(default_factory=dict)
    steps: tuple[float, ...] = ()


def read(text: str) -> Run:
    return read_node(Run, parse_text(text, "run.yaml"))


def test_the_declared_type_decides_and_yaml_never_guesses() -> None:
    run = read("name: off\nlens: {baseline_m: 1e-3}\nsteps: [1e-3, 010]\nis_wet: yes\ncounts: {no: 1}\nnote: ~\n")
    assert run.name == "off"
    assert run.lens.baseline_m == 1e-3
    assert run.steps == (0.001, 10.0)
    assert run.is_wet is True
    assert run.counts == {"no": 1}
    assert run.note is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "name: a\nlens: {basline_m: 1}\n",
            r"run.yaml:2:8: lens.basline_m: unknown key \(did you mean 'baseline_m'\?\)",
        ),
        ("name: a\nlens: {baseline_m: 12cm}\n", r"run.yaml:2:20: lens.baseline_m: expected float, got '12cm'"),
        ("name: a\nlens: {baseline_m: -1}\n", r"run.yaml:2:20: lens.baseline_m: must be > 0"),
        ("name: a\nname: b\n", r"run.yaml:2:1: name: given twice \(first in line 1\)"),
        ("mode: film\n", r"run.yaml:1:1: name: missing"),
        ("name: a\nmode: flim\n", r"run.yaml:2:7: mode: expected one of film, fast, got 'flim'; did you mean film\?"),
        ("name: a\nlens: 3\n", r"run.yaml:2:7: lens: expected keys and values, got '3'"),
        ("name: a\nlens: {size_px: [1, 2, 3]}\n", r"run.yaml:2:17: lens.size_px: expected 2 items, got 3"),
        ("name: a\nlens: {size_px: [1, 2.5]}\n", r"run.yaml:2:21: lens.size_px\[1\]: expected int, got '2.5'"),
        ("name: a\nlens: {baseline_m: .inf}\n", r"expected float, got '.inf'"),
        ("name: a\nlens: {baseline_m: inf}\n", r"expected float, got 'inf'"),
        ("name:\n", r"run.yaml:1:6: name: expected str, got nothing"),
        ("name: a\n  mode: film\n", r"run.yaml:2:\d+: is not YAML"),
        ("name: a\nmode: f\x01lm\n", r"run.yaml:2:8: is not YAML: special characters are not allowed \('\\x01'\)$"),
        ("name: !!python/object:os.system a\n", r"Python tags are not read"),
        ("[1, 2]\n", r"expected keys and values, got a list"),
        ("name: &a [*a]\n", r"run.yaml:1:7: name\[0\]: an alias that contains itself"),
    ],
)
def test_a_mistake_is_one_line_with_its_place(text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        read(text)
    assert "\n" not in str(caught.value)


def test_aliases_of_aliases_cost_nothing() -> None:
    bomb = "a0: &a0 [x]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 40))
    with pytest.raises(ConfigError, match="unknown key"):
        read(bomb)


def test_options_of_aliases_of_aliases_are_refused_and_not_written_out() -> None:
    bomb = "&a0 [x]"
    for i in range(1, 40):
        bomb = f"&a{i} [{bomb}{f', *a{i - 1}' * 9}]"
    node = parse_text(f"name: a\noptions: {bomb}\n", "run.yaml")
    with pytest.raises(ConfigError, match=r"run.yaml:1:1: holds more than 100000 values with its aliases written out"):
        to_plain(node)
    few = parse_text("a: &a [1, ~]\nb: [*a, *a]\n", "run.yaml")
    assert to_plain(few) == {"a": ["1", None], "b": [["1", None], ["1", None]]}


def test_settings_go_through_the_same_reader() -> None:
    node = parse_text("name: a\nlens: {baseline_m: 1}\n", "run.yaml")
    run = read_node(Run, with_overrides(node, ["lens.baseline_m=2", "steps=[1, 2]", "note=null", "lens.baseline_m=3"]))
    assert (run.lens.baseline_m, run.steps, run.note) == (3.0, (1.0, 2.0), None)
    with pytest.raises(ConfigError, match=r"--set lens.basline=2: lens.basline: unknown key"):
        read_node(Run, with_overrides(node, ["lens.basline=2"]))
    with pytest.raises(ConfigError, match="expected KEY=VALUE"):
        with_overrides(node, ["lens"])


def test_what_is_wrong_in_a_setting_has_no_line() -> None:
    """One sees the whole of it; `--set lens.baseline_m=x:1:1` would look like a value of another text."""
    node = parse_text("name: a\n", "run.yaml")
    for setting, problem in (
        ("lens.baseline_m=x", r"^--set lens.baseline_m=x: lens.baseline_m: expected float, got 'x'$"),
        ("lens={baseline_m: x}", r"^--set lens=\{baseline_m: x\}: lens.baseline_m: expected float"),
        ("steps=[1, b]", r"^--set steps=\[1, b\]: steps\[1\]: expected float, got 'b'$"),
        ("lens={baseline_m: -1}", r"^--set lens=\{baseline_m: -1\}: lens.baseline_m: "),
    ):
        with pytest.raises(ConfigError, match=problem):
            read_node(Run, with_overrides(node, [setting]))


def test_aliases_of_a_setting_cost_nothing() -> None:
    bomb = "&a0 [x]"
    for i in range(1, 40):
        bomb = f"&a{i} [{bomb}{f', *a{i - 1}' * 9}]"
    node = with_overrides(parse_text("name: a\n", "run.yaml"), [f"steps={bomb}"])
    with pytest.raises(ConfigError, match=r"steps\[0\]: expected float, got a list$"):
        read_node(Run, node)


@pytest.mark.parametrize("text", ["#1", "data/run #2", " runs/a#b ", "'data/run #2'", '"#1"'])
def test_nothing_of_a_setting_is_a_comment(text: str) -> None:
    node = with_overrides(parse_text("name: a\n", "run.yaml"), [f"name={text}"])
    assert read_node(Run, node).name == text.strip().strip("'\"")


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("name.b.c=2", r"^--set name.b.c=2: name: is 'a', which has no key 'b'; set it as a whole$"),
        ("lens.size_px.0=2", r"^--set lens.size_px.0=2: lens.size_px: is a list, which has no key '0'"),
    ],
)
def test_a_setting_goes_through_keys_alone(setting: str, message: str) -> None:
    node = parse_text("name: a\nlens: {size_px: [1, 2]}\ncounts: ~\n", "run.yaml")
    with pytest.raises(ConfigError, match=message):
        with_overrides(node, [setting])
    assert read_node(Run, with_overrides(node, ["counts.one=1"])).counts == {"one": 1}


def test_brackets_without_end_are_one_line(tmp_path: Path) -> None:
    deep = "[" * 3000 + "]" * 3000
    (tmp_path / "deep.yml").write_text(f"name: {deep}\n")
    with pytest.raises(ConfigError, match=r"deep.yml: is nested too deeply"):
        parse_file(tmp_path / "deep.yml")
    with pytest.raises(ConfigError, match=r"is nested too deeply"):
        with_overrides(parse_text("name: a\n", "run.yaml"), [f"name={deep}"])


def test_a_file_that_cannot_be_read_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot read it"):
        parse_file(tmp_path / "none.yml")
    (tmp_path / "latin.yml").write_bytes(b"# caf\xc3\xa9\nname: \xe9\n")
    with pytest.raises(ConfigError, match=r"latin.yml:2:7: is not UTF-8 text \(byte 0xe9\); save it as UTF-8"):
        parse_file(tmp_path / "latin.yml")


words = st.text(st.characters(codec="ascii", categories=["L", "N", "P", "Z", "S"]), min_size=1, max_size=20)


@given(
    st.builds(
        Run,
        name=words,
        mode=st.sampled_from(["film", "fast"]),
        is_wet=st.booleans(),
        note=st.none() | words,
        lens=st.builds(Lens, baseline_m=st.floats(1e-6, 1e6)),
        counts=st.dictionaries(words, st.integers(-(10**9), 10**9), max_size=3),
        steps=st.lists(st.floats(-1e12, 1e12, allow_nan=False), max_size=4).map(tuple),
    )
)
def test_what_is_dumped_reads_back(run: Run) -> None:
    assert read(to_yaml(run)) == run


@dataclass(frozen=True, kw_only=True)
class Rig:
    near: Lens = field(default_factory=lambda: Lens(baseline_m=0.2, size_px=(640, 480)))
    far: Lens | None = Lens(baseline_m=2.0)
    spare: Lens | None = None
    alone: Lens = field(default_factory=lambda: Lens(baseline_m=3.0), metadata=WHOLE)


@dataclass(frozen=True, kw_only=True)
class Car:
    rig: Rig = field(default_factory=lambda: Rig(near=Lens(baseline_m=0.7, size_px=(8, 8))))


def test_keys_that_are_not_given_are_those_of_the_fields_own_default() -> None:
    rig = read_node(Rig, with_overrides(parse_text("far: {size_px: [2, 1]}", "r.yaml"), ["near.baseline_m=0.3"]))
    assert rig.near == Lens(baseline_m=0.3, size_px=(640, 480))
    assert rig.far == Lens(baseline_m=2.0, size_px=(2, 1))
    deep = read_node(
        Car, with_overrides(parse_text("{}", "c.yaml"), ["rig.near.baseline_m=0.3", "rig.spare.baseline_m=9"])
    )
    assert deep.rig.near == Lens(baseline_m=0.3, size_px=(8, 8)) and deep.rig.spare == Lens(baseline_m=9)
    assert deep.rig.far == Lens(baseline_m=2.0)


def test_a_default_that_is_one_thing_lends_no_keys() -> None:
    """As a scene's limits: who says where cars drive, ahead of a board, does not also mean the usual radius."""
    rig = read_node(Rig, parse_text("alone: {size_px: [2, 1]}", "r.yaml"))
    assert rig.alone == Lens(size_px=(2, 1))
