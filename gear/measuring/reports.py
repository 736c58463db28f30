"""The reports of an evaluation, each of which is a set of metrics.

Every evaluation has the task's own metrics; tasks with objects also have the report `objects`. Other reports are
requested by name:

- `outside_patch` is the task's own metrics without the ground truth on and next to the patch.
- A task may have further reports, such as `reference`.
- Any other name is that of a metric plugin (`gear_metrics`), with options after a colon:
  `boundary_iou:width_share=0.01`.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.evaluation import Maskable, Reports, WithObjects
from gear.contracts.specs import MetricSpec
from gear.contracts.tasks import Evaluator
from gear.dataset.checks.output_checks import check_metrics
from gear.dataset.plan import Plan
from gear.dataset.reading import Dataset
from gear.measuring.guarded_model import plugin_error
from gear.measuring.object_report import OBJECTS, ObjectEvaluator
from gear.measuring.plugin_selection import Chosen
from gear.plugins.build import NO_OPTIONS, broken_hint, find, name_of_task, plugins_of_kind
from gear.plugins.manager import DISTRIBUTION
from gear.plugins.text import one_line
from gear.values.errors import GearError, UnknownNameError
from gear.values.serial import Json

TASK = "task"
"""Name of the report with the task's own metrics."""

OUTSIDE_PATCH = "outside_patch"

NEXT_OPTION = re.compile(r",(?=[\w.]+=)")
"""Pattern of a comma between two options `KEY=VALUE`; other commas belong to a value."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Report:
    """One report of an evaluation: a set of metrics over a dataset.

    Attributes:
        name: name as the user gave it.
        make: function that returns a new, empty evaluator.
        plan: plan of the evaluated dataset.
        plugin: the metric plugin with its options; None for the task's own metrics and reports.
    """

    name: str
    make: Callable[[], Evaluator[Any, Any]]
    plan: Plan
    plugin: Chosen | None = None

    def checked(self, given: Any, method: str) -> dict[str, float]:
        """Checks the metrics that a method of the evaluator returned, and returns them by name.

        Args:
            given: value that the method returned.
            method: name of the method, for the error message.

        Raises:
            PluginError: the value is not a mapping of names to numbers; the error names the plugin.
        """
        try:
            return check_metrics(given, method)
        except TypeError as error:
            found = find("task", name_of_task(self.plan.task)) if self.plugin is None else self.plugin.found
            raise plugin_error(found, "its evaluator", str(error)) from error

    @contextlib.contextmanager
    def blamed(self, method: str) -> Iterator[None]:
        """A context for calls of the evaluator's code; an error in a metric of another package names its plugin.

        Args:
            method: name of the method that is called, for the error message.

        Raises:
            PluginError: the evaluator of another package's metric raised something other than a `GearError`.
        """
        try:
            yield
        except (GearError, KeyboardInterrupt):
            raise
        except BaseException as error:
            if self.plugin is None or self.plugin.found.owner.package == DISTRIBUTION:
                raise
            raise plugin_error(self.plugin.found, f"{method} of its evaluator", one_line(error)) from error

    def facts(self) -> Json:
        """A plugin metric's name, package, version, options, `metric`, `unit` and `lower_is_better`, as JSON for the
        results; None for the task's own reports.
        """
        if self.plugin is None:
            return None
        spec = self.plugin.found.spec
        assert isinstance(spec, MetricSpec)
        said = {"metric": spec.metric, "unit": spec.unit, "lower_is_better": spec.lower_is_better}
        return self.plugin.facts() | said


def task_report(dataset: Dataset[Any]) -> Report:
    """The report with the metrics that the task of `dataset` itself defines."""
    return Report(name=TASK, make=dataset.task.evaluator, plan=dataset.plan)


def reports_of(names: Iterable[str], dataset: Dataset[Any]) -> dict[str, Report]:
    """The reports of an evaluation by name: the task's own metrics, `objects` if the task has objects, and the
    requested ones.

    Args:
        names: names of further reports: metric plugins, or reports of the task.
        dataset: a dataset of the evaluation; its task and plan decide the reports.

    Raises:
        UnknownNameError: neither the task nor a plugin has a report of this name.
        GearError: a metric is for other tasks, or an option of it does not fit.
    """
    found = {TASK: task_report(dataset)}
    task = dataset.task
    if isinstance(task, WithObjects):
        found[OBJECTS] = Report(name=OBJECTS, make=lambda: ObjectEvaluator(task), plan=dataset.plan)
    for name in names:
        if name != OBJECTS or OBJECTS not in found:
            found[name] = _report(name, dataset)
    return found


def _report(name: str, dataset: Dataset[Any]) -> Report:
    task, plan = dataset.task, dataset.plan
    if name == OUTSIDE_PATCH and isinstance(task, Maskable):
        return Report(name=name, make=task.evaluator, plan=plan)
    if isinstance(task, Reports) and name in task.reports():
        return Report(name=name, make=lambda: task.reports()[name], plan=plan)
    plugin, _, settings = name.partition(":")
    known = {one.spec.name: one for one in plugins_of_kind("metric")}
    known |= {one.full_name: one for one in plugins_of_kind("metric")}
    if plugin not in known:
        own = [OUTSIDE_PATCH] if isinstance(task, Maskable) else []
        own += list(task.reports()) if isinstance(task, Reports) else []
        fitting = [one for one, entry in known.items() if _suits(entry.spec, plan)]
        kind = f"report of task {plan.task['name']!r}"
        raise UnknownNameError(kind, plugin, [*own, *fitting], broken_hint())
    entry = find("metric", plugin)
    if not _suits(entry.spec, plan):
        assert isinstance(entry.spec, MetricSpec)
        raise GearError(
            f"metric {plugin!r} is for {', '.join(entry.spec.tasks)}; {dataset.root} is a {plan.task['name']} dataset"
        )
    options = with_overrides(NO_OPTIONS, NEXT_OPTION.split(settings) if settings else ())
    chosen, config = Chosen(found=entry, options=options), read_node(entry.spec.config, options, "")

    return Report(name=name, make=lambda: entry.spec.build(config), plan=plan, plugin=chosen)


def _suits(spec: Any, plan: Plan) -> bool:
    return isinstance(spec, MetricSpec) and plan.task["name"] in spec.tasks
