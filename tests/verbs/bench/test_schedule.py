"""Steps of a bench over the workers of an engine: order, failures, lost workers, and the results of one run."""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.contracts.executors import Executor, Outcome, Report, Work
from gear.dataset.executors.in_process import InThisProcess
from gear.dataset.locks import exclusive_lock
from gear.values.errors import DatasetError, GearError
from gear.values.progress import Callbacks
from gear.verbs.bench import run
from gear.verbs.bench.carry_out import VERBS
from gear.verbs.bench.plan import Step, Verb
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.schedule import dependencies, make_steps, run_steps
from tests.verbs.bench.conftest import FEW


def step(verb: Verb, out: str, **arguments: Any) -> Step:
    sized = {"task": "semseg", "split": "test", "samples": 1} if verb == "collect" else {}
    return Step(verb=verb, title=f"{verb} {out}", arguments={"out": out, **sized, **arguments})


STEPS = (
    step("collect", "clean"),
    step("collect", "control", patch="random"),
    step("attack", "patch", data=["clean"], val=["clean"]),
    step("collect", "patched", patch="patch"),
    step("evaluate", "small", data=["clean", "control"]),
    step("evaluate", "guarded", data=["clean", "patched"], calibration="clean", calibration_patched="control"),
)
"""The steps of a bench with one network: each is named by the folder of its results."""


class Backwards:
    """An executor that carries out the items in reverse order, and loses some of them the first time."""

    def __init__(self, lost: Sequence[int] = ()) -> None:
        self.lost = set(lost)
        self.waves: list[list[int]] = []

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        self.waves.append(list(indices))
        for index in sorted(indices, reverse=True):
            if index in self.lost:
                self.lost.remove(index)
                report(Outcome(index=index, kind="failed", error="a worker was lost"))
            else:
                work(iter([index]), report)


@pytest.fixture
def carried_out(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The folders of the steps that were carried out, in order; `bad` in the arguments of a step makes it fail."""
    there: list[str] = []

    def called(**arguments: Any) -> str:
        if arguments.get("bad"):
            raise GearError("no such picture")
        there.append(arguments["out"])
        arguments["on_warning"](f"a note on {arguments['out']}")
        return f"report of {arguments['out']}"

    for verb in VERBS:
        monkeypatch.setitem(VERBS, verb, called)
    return there


def run_all(
    steps: Sequence[Step],
    executor: Executor,
    callbacks: Callbacks | None = None,
    root: Path = Path(),
    **given: Any,
) -> Any:
    given = {"workers": 1, "callbacks": callbacks or Callbacks(), **given}
    return run_steps(steps, root, rendering=executor, networks=executor, **given)


def test_a_step_needs_the_steps_whose_folders_it_reads() -> None:
    assert dependencies(STEPS) == [
        frozenset(), frozenset(), frozenset({0}), frozenset({2}), frozenset({0, 1}), frozenset({0, 1, 3}),
    ]  # fmt: skip


def test_no_step_is_carried_out_before_those_that_it_needs(carried_out: list[str]) -> None:
    seen: list[tuple[int, int]] = []
    executor, notes, ended = Backwards(), list[str](), list[str]()
    found = run_all(
        STEPS,
        executor,
        Callbacks.of(on_warning=notes.append, on_progress=lambda done, total: seen.append((done, total))),
        on_step=lambda one, number, steps: ended.append(f"{number}/{steps} {one.arguments['out']}"),
    )
    assert carried_out == ["control", "clean", "small", "patch", "patched", "guarded"]
    assert [wave for wave in executor.waves if wave] == [[0, 1], [2, 4], [3], [5]]
    assert found == {"small": "report of small", "guarded": "report of guarded"}
    assert sorted(notes) == sorted(f"a note on {out}" for out in carried_out)
    assert ended[0] == "1/6 control" and ended[-1] == "6/6 guarded"
    assert seen == [(done, 6) for done in range(7)]


def test_workers_share_the_samples_of_a_few_collections(carried_out: list[str]) -> None:
    """With fewer collections than workers, some workers would have nothing to do."""
    executor = Backwards()
    run_all(STEPS, executor, workers=3)
    assert [wave for wave in executor.waves if wave] == [[2, 4], [5]]
    assert carried_out[:2] == ["clean", "control"]


def test_a_failed_step_costs_those_alone_that_need_it(carried_out: list[str], tmp_path: Path) -> None:
    steps = list(STEPS)
    steps[2] = step("attack", "patch", data=["clean"], bad=True)
    with pytest.raises(GearError) as caught:
        run_all(steps, Backwards(), root=tmp_path)
    assert carried_out == ["control", "clean", "small"]
    noted = f"; the errors are noted in {tmp_path}/failures"
    assert str(caught.value) == f"attack patch: no such picture; 2 more of 6 steps were not carried out{noted}"
    assert [path.name for path in (tmp_path / "failures").iterdir()] == ["2.json"]


def test_a_step_whose_worker_is_lost_is_tried_again(carried_out: list[str], tmp_path: Path) -> None:
    notes: list[str] = []
    run_all(STEPS, Backwards(lost=[2]), Callbacks.of(on_warning=notes.append), root=tmp_path)
    assert carried_out.count("patch") == 1 and carried_out[-1] == "guarded"
    assert "attack patch: a worker was lost" in notes


def test_a_step_whose_worker_is_lost_each_time_is_named(tmp_path: Path) -> None:
    class Losing:
        def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
            for index in indices:
                report(Outcome(index=index, kind="failed", error="a worker was lost"))

    with pytest.raises(GearError, match=r"collect clean: a worker was lost; 5 more of 6 steps were not carried out"):
        run_all(STEPS, Losing(), root=tmp_path)


def test_a_worker_whose_steps_all_fail_takes_no_more(carried_out: list[str], tmp_path: Path) -> None:
    reported: list[Outcome] = []
    steps = [step("collect", str(number), bad=True) for number in range(9)]
    make_steps(steps, Path(), None, {}, range(9), reported.append)
    assert [outcome.index for outcome in reported] == list(range(5))
    with pytest.raises(GearError, match=r"collect 0: no such picture; 8 more of 9"):
        run_all(steps, InThisProcess(), root=tmp_path)


def test_a_machine_without_the_folder_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(GearError, match="is not there on this machine; run the command in a folder that all machines"):
        make_steps(STEPS, Path(), str(tmp_path / "elsewhere"), {}, [0], lambda outcome: None)


def test_several_workers_or_an_engine_schedule_the_steps() -> None:
    request = BenchRequest(config="quick", out="out")
    assert not request.is_scheduled
    assert dataclasses.replace(request, workers=2).is_scheduled
    assert dataclasses.replace(request, engine="slurm").is_scheduled


@pytest.mark.usefixtures("plugins")
def test_a_second_run_in_the_same_folder_says_so(tmp_path: Path, written: Callable[..., Path]) -> None:
    out = tmp_path / "out"
    with exclusive_lock(out), pytest.raises(DatasetError, match="another gear run is using this folder"):
        gear.bench(written(*FEW), out=out)
    assert not list(out.iterdir())


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps are scheduled, but carried out in this process, where the tiny networks are plugins."""
    monkeypatch.setattr(run, "open_engine", lambda *names, **given: InThisProcess())


@pytest.mark.slow
@pytest.mark.usefixtures("plugins", "in_this_process")
def test_scheduled_steps_have_the_results_of_one_run(
    tmp_path: Path, written: Callable[..., Path], made: Callable[..., Path]
) -> None:
    one, out = made(FEW), tmp_path / "scheduled"
    gear.bench(written(*FEW), out=out, engine="slurm")
    pictures = sorted(path.relative_to(out) for path in _pictures(out))
    assert pictures == sorted(path.relative_to(one) for path in _pictures(one)) and len(pictures) > 20
    assert all((out / path).read_bytes() == (one / path).read_bytes() for path in pictures)
    assert _metrics(out) == _metrics(one)


def _pictures(root: Path) -> Iterator[Path]:
    yield from root.glob("data/**/*.png")
    yield from root.glob("patches/**/patch*")


def _metrics(out: Path) -> list[dict[str, str]]:
    with (out / "bench.csv").open() as file:
        return [{key: value for key, value in line.items() if "second" not in key} for line in csv.DictReader(file)]
