"""Distributes the steps of a benchmark over the workers of an engine: processes, Ray or SLURM.

Steps that depend on no unfinished step form a wave. The workers of the engine carry out the steps of one wave in
parallel; the next wave begins when all of them have ended.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from gear.contracts.executors import Executor, Outcome, Report, Work
from gear.dataset.executors.calibrations import CalibrationReports
from gear.dataset.executors.in_process import InThisProcess
from gear.dataset.executors.jobs import FAILURES, JobNotes, carry_out_jobs, run_jobs, shared_folder
from gear.values.errors import GearError
from gear.values.progress import Callbacks
from gear.verbs.bench.carry_out import carry_out
from gear.verbs.bench.disk import PictureSpace
from gear.verbs.bench.plan import Step

INPUTS = ("data", "val", "calibration", "calibration_patched", "patch")
"""Arguments of a step that name folders, which other steps may have made."""

ALONE: dict[str, Any] = {"workers": 1, "engine": "processes", "address": None}
"""Arguments of a collection or of drives that are all made by the worker that carries out the step."""

OnStep = Callable[[Step, int, int], None]
"""A callback that gets the step, its number (from 1) and the number of all steps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StepResult:
    """The result of a step that a worker has carried out.

    Attributes:
        value: the report of a step that evaluates or drives; None for other steps.
        warnings: warnings of the step, one line each.
    """

    value: Any
    warnings: tuple[str, ...]


def dependencies(steps: Sequence[Step]) -> list[frozenset[int]]:
    """Returns, for each step, the positions of the steps whose results it reads."""
    makers = {step.arguments["out"]: position for position, step in enumerate(steps)}
    return [frozenset(makers[path] for path in _inputs(step) if path in makers) for step in steps]


def _inputs(step: Step) -> Iterator[str]:
    """Yields the paths of the folders that a step reads."""
    yield from step.inputs
    for name in INPUTS:
        value = step.arguments.get(name, ())
        yield from (value,) if isinstance(value, str) else value


def run_steps(
    steps: Sequence[Step],
    root: Path,
    *,
    rendering: Executor,
    networks: Executor,
    workers: int,
    callbacks: Callbacks,
    on_step: OnStep | None = None,
) -> dict[str, Any]:
    """Carries out all steps of a benchmark with the workers of an engine.

    If a wave has fewer collections than there are workers, the workers share the samples of each collection. Otherwise
    each worker carries out whole steps. A step that fails keeps only those steps from being carried out that depend on
    it.

    Args:
        steps: all steps, each after the steps that it depends on.
        root: folder of the benchmark.
        rendering: executor of the collections.
        networks: executor of the attacks, evaluations and drives.
        workers: number of workers that render.
        callbacks: callbacks that receive the number of finished steps, and warnings.
        on_step: called after each step, with the number of finished steps.

    Returns:
        The reports of the evaluations and of the drives, by their folder.

    Raises:
        GearError: steps have failed; the message names the first one. All other steps were carried out.
    """
    space = PictureSpace(steps, root, callbacks.on_warning)
    running = _Running(steps=steps, root=root, callbacks=callbacks, on_step=on_step, space=space)
    needed = dependencies(steps)
    callbacks.on_progress(0, len(steps))
    while wave := [
        position
        for position, before in enumerate(needed)
        if position not in running.ended and before <= running.results.keys()
    ]:
        collections = [position for position in wave if steps[position].verb == "collect"]
        if len(collections) < workers:
            running.carry_out_here(collections)
        else:
            running.carry_out_in_workers(rendering, collections)
        running.carry_out_in_workers(networks, [position for position in wave if position not in collections])
    running.raise_failures()
    return {
        steps[position].arguments["out"]: result.value
        for position, result in running.results.items()
        if result.value is not None
    }


@dataclass(slots=True, kw_only=True, eq=False)
class _Running:
    """The state of the steps while a benchmark runs.

    Attributes:
        steps, root, callbacks, on_step: arguments of `run_steps`.
        space: checks that the pictures fit on the disk.
        results: results of the finished steps, by position.
        failed: outcomes of the steps that failed, by position.
    """

    steps: Sequence[Step]
    root: Path
    callbacks: Callbacks
    on_step: OnStep | None
    space: PictureSpace
    results: dict[int, StepResult] = field(default_factory=dict)
    failed: dict[int, Outcome] = field(default_factory=dict)

    @property
    def ended(self) -> set[int]:
        """The positions of the steps that are finished or have failed."""
        return {*self.results, *self.failed}

    def carry_out_here(self, collections: Sequence[int]) -> None:
        """Carries out the collections at some positions, one after the other; workers share the samples of each."""
        self._run(InThisProcess(), partial(make_steps, self.steps, self.root, None, {}), collections)

    def carry_out_in_workers(self, executor: Executor, positions: Sequence[int]) -> None:
        """Carries out the steps at some positions in parallel; steps whose worker was lost are tried again."""
        self._run(executor, partial(make_steps, self.steps, self.root, str(Path.cwd()), ALONE), positions)

    def _run(self, executor: Executor, work: Work, positions: Sequence[int]) -> None:
        notes = JobNotes(root=self.root, names=[step.title for step in self.steps])
        run_jobs(executor, work, positions, self._report, callbacks=self.callbacks, notes=notes)

    def _report(self, outcome: Outcome) -> None:
        """Notes the outcome of a step."""
        step = self.steps[outcome.index]
        if outcome.kind == "failed":
            self.failed[outcome.index] = outcome
            self.callbacks.on_warning(_problem(step, outcome))
            return
        self.failed.pop(outcome.index, None)
        assert isinstance(outcome.value, StepResult)
        self.results[outcome.index] = outcome.value
        for line in outcome.value.warnings:
            self.callbacks.on_warning(line)
        self.space.step_done(step)
        if self.on_step is not None:
            self.on_step(step, len(self.results), len(self.steps))
        self.callbacks.on_progress(len(self.results), len(self.steps))

    def raise_failures(self) -> None:
        """Raises:
        GearError: a step has failed.
        """
        if not self.failed:
            return
        first = min(self.failed)
        left = len(self.steps) - len(self.results) - 1
        more = f"; {left} more of {len(self.steps)} steps were not carried out" if left else ""
        noted = f"; the errors are noted in {self.root / FAILURES}"
        raise GearError(f"{_problem(self.steps[first], self.failed[first])}{more}{noted}")


def _problem(step: Step, outcome: Outcome) -> str:
    """The error of a failed step in one line, which begins with the title of the step."""
    return outcome.error if outcome.error.startswith(step.title) else f"{step.title}: {outcome.error}"


def make_steps(
    steps: Sequence[Step],
    root: Path,
    folder: str | None,
    changed: dict[str, Any],
    indices: Iterable[int],
    report: Report,
) -> None:
    """Carries out steps one after the other; runs in a worker.

    Args:
        steps: all steps of the benchmark.
        root: folder of the benchmark.
        folder: current folder of the command, to which paths of the steps are relative; None if the worker is the
            process of the command.
        changed: arguments of collections and drives that replace those of the steps.
        indices: positions of the steps.
        report: called with the outcome of each step. An error that the user can correct is a failure of its step.

    Raises:
        GearError: the folder is not there on the worker's machine.
    """

    def call(index: int) -> StepResult:
        step, warnings = steps[index], list[str]()
        callbacks = CalibrationReports(report=report, index=index).callbacks(warnings.append)
        value = carry_out(step, root, callbacks, changed=changed if step.verb in ("collect", "drive") else None)
        return StepResult(value=value if step.verb in ("evaluate", "drive") else None, warnings=tuple(warnings))

    with shared_folder(folder):
        carry_out_jobs(call, indices, report)
