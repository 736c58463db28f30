"""`gear.check_record`: measures a part of a record again and says whether the record is reproduced."""

from __future__ import annotations

import importlib.metadata
import platform
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from gear.collecting.job import versions
from gear.contracts.specs import DefenseSpec
from gear.dataset.files import write_whole
from gear.leaderboard.package_facts import printable
from gear.leaderboard.reading import Filed, read_record
from gear.leaderboard.record import Record
from gear.leaderboard.rules import NONE, faults, warnings
from gear.leaderboard.verdict import Finding, State, Verdict, finding
from gear.reporting.display import displayed
from gear.values.errors import GearError
from gear.values.progress import Callbacks, PhaseProgress, Progress
from gear.values.rng import derive_rng
from gear.verbs.leaderboard.compare import (
    compare_fresh,
    compare_plugins,
    compare_repeated,
    compare_withheld,
    is_same_machine,
)
from gear.verbs.leaderboard.drive_check import check_drives, chosen_drives
from gear.verbs.leaderboard.figures import compare_figures, compare_reference
from gear.verbs.leaderboard.request import CheckRequest
from gear.verbs.leaderboard.rerun import Again, Rerun, check_data
from gear.verbs.leaderboard.withheld import Withheld, read_withheld

FRESH_PLACES = 3
"""Largest number of places in which fresh samples are made."""


def check_record(
    record: str | Path,
    *,
    work: str | Path | None = None,
    out: str | Path | None = None,
    patches: str | Path | None = None,
    samples: int = 4,
    fresh: int = 8,
    drives: int = 2,
    seed: int = 0,
    settings: Iterable[str] = (),
    withheld: str | Path | None = None,
    commitment: str | None = None,
    most_pictures: int = 2000,
    device: str | None = None,
    progress: bool = False,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
    on_fit_phase: PhaseProgress | None = None,
) -> Verdict:
    """Checks a record: the rules of the leaderboard, the installed plugins, and results of samples that are made and
    measured again.

    Repeated samples must give the same predictions on the same kind of machine, and metrics within a tolerance
    elsewhere. Fresh samples, with a seed that is not part of the benchmark, must give metrics of the same distribution.
    The ranked metric is computed again if all samples of the benchmark are repeated, or if it is the mean of the values
    of the samples; otherwise the verdict is `incomplete`. Some drives of the record, which repeat bit for bit, are made
    again; the hash of the log and the outcome must be equal. Nothing in the record is run; its plugins must be
    installed.

    Args:
        record: file of the record.
        work: folder for data; a temporary folder by default.
        out: folder that gets the verdict as `<sha256 of the record>.json`; by default none is written.
        patches: folder with the patches, by default `patches` beside the record.
        samples: number of samples that are measured again, each with every kind of patch.
        fresh: number of fresh samples for every kind of patch; 0 for none.
        drives: number of drives that are made again, if the record has drives.
        seed: seed by which samples and drives are chosen; it should not be known to the author of the record.
        settings: `KEY=VALUE` texts that replace keys of the record's config, such as files that lie elsewhere here.
        withheld: file with withheld scenes, whose seed and places are used for the fresh samples.
        commitment: published salted hash of that file.
        most_pictures: largest number of pictures that are rendered.
        device: device of the networks; by default that of the config.
        progress: shows a progress bar.
        on_progress: called after every sample.
        on_fit_progress: called after every calibration sample that the defense reads for the first time.
        on_fit_phase: called with (unit, done, total) after every step of a phase of the calibration, such as a training
            step, if the defense reports its phases.

    Raises:
        GearError: the record is refused, a plugin or a patch is missing, or the check would render too many pictures.
    """
    callbacks = Callbacks.of(on_progress=on_progress, on_fit_progress=on_fit_progress, on_fit_phase=on_fit_phase)
    with ExitStack() as stack, displayed(callbacks, "leaderboard check", progress=progress) as shown:
        folder = work if work is not None else stack.enter_context(tempfile.TemporaryDirectory(prefix="gear-check-"))
        request = CheckRequest(
            record=record,
            work=folder,
            out=out,
            patches=patches,
            samples=samples,
            fresh=fresh,
            drives=drives,
            seed=seed,
            settings=tuple(settings),
            withheld=withheld,
            commitment=commitment,
            most_pictures=most_pictures,
            device=device,
        )
        return run_check(request, shown)


def run_check(request: CheckRequest, callbacks: Callbacks) -> Verdict:
    """Runs a check with the arguments in `request`, which `gear.check_record` describes: samples of the record are made
    and measured again, and compared with the record.

    Args:
        request: the arguments.
        callbacks: callbacks that receive progress and warnings.

    Raises:
        GearError: the record is refused, a plugin or a patch is missing, or the check would render too many pictures.
    """
    filed = read_record(Path(request.record))
    record = filed.record
    secret = None if request.withheld is None else read_withheld(Path(request.withheld), request.commitment)
    patches = Path(request.patches) if request.patches is not None else filed.path.parent / "patches"
    rerun = Rerun(record, Path(request.work), patches, request.settings, request.device, callbacks)
    check_data(record, places=len(rerun.plan.places()), samples=rerun.plan.config.samples.measure)
    chosen = _chosen(record, request)
    _refuse_many(rerun, chosen, request)
    drives = chosen_drives(rerun, request)
    count = _Counter(callbacks.on_progress, (len(chosen) + request.fresh) * len(_kinds(rerun)))
    found = [*_static(record), *compare_plugins(rerun)]
    again = _again(rerun, chosen, count)
    environment = _environment(rerun)
    is_same = is_same_machine(record, environment)
    found += compare_repeated(record, again, is_same=is_same)
    found += _compare_built(rerun, record)
    figures = compare_figures(record, again, rerun.ranked, is_same=is_same)
    found += figures.findings
    is_every = len(again) == sum(one.samples for one in record.data if one.patch in _kinds(rerun))
    alone = _again(rerun, chosen, count, with_defense=False) if is_every and record.entry.defense is not None else []
    found += compare_reference(record, alone, rerun.ranked)
    found += check_drives(rerun, drives, callbacks, is_same=is_same)
    if request.fresh:
        found += _fresh(rerun, request, secret, count)
    verdict = Verdict(
        record_sha256=filed.sha256,
        state=_state(found, is_whole=bool(again) and figures.is_whole),
        seed=request.seed,
        repeated=len(again),
        fresh=request.fresh * len(_kinds(rerun)),
        environment=environment,
        findings=tuple(found),
    )
    if request.out is not None:
        write_whole(Path(request.out), f"{filed.sha256}.json", verdict.encoded())
    return verdict


def summary(filed: Filed, verdict: Verdict) -> str:
    """The verdict as text: one line per finding, and the state at the end.

    Args:
        filed: the record with its file.
        verdict: result of the check.
    """
    lines = [f"{one.level}: {one.text}" for one in verdict.findings]
    return "\n".join([*lines, f"{printable(filed.path.name)}: {verdict.state}"]) + "\n"


class _Counter:
    """Counts finished samples for the progress display."""

    def __init__(self, on_progress: Progress, total: int) -> None:
        self._on_progress, self._done, self._total = on_progress, 0, total

    def __call__(self, one: Again) -> Again:
        self._done += 1
        self._on_progress(min(self._done, self._total), self._total)
        return one


def _kinds(rerun: Rerun) -> list[str]:
    """The kinds of patches that can be measured again; patches of other networks (transfer) cannot."""
    return [kind for kind in rerun.record.kinds() if kind in rerun.planned.pools]


def _chosen(record: Record, request: CheckRequest) -> list[tuple[int, int]]:
    """Draws (place, index) pairs of samples of the benchmark, without repetition."""
    clean = [one for one in record.data if one.patch == NONE]
    if not clean:
        raise GearError(f"{request.record}: has no pictures without a patch")
    every = [(place, index) for place, one in enumerate(clean) for index in range(one.samples)]
    rng = derive_rng(request.seed, "leaderboard", "samples")
    drawn = rng.permutation(len(every))[: request.samples]
    return sorted(every[int(number)] for number in drawn)


def _again(
    rerun: Rerun, chosen: Sequence[tuple[int, int]], count: Callable[[Again], Again], *, with_defense: bool = True
) -> list[Again]:
    """Measures the chosen samples again with every kind of patch."""
    return [
        count(one)
        for place in dict.fromkeys(place for place, _ in chosen)
        for patch in _kinds(rerun)
        for one in rerun.again(patch, place, [index for at, index in chosen if at == place], with_defense=with_defense)
    ]


def _refuse_many(rerun: Rerun, chosen: Sequence[tuple[int, int]], request: CheckRequest) -> None:
    sides = 2 if request.withheld is not None else 1
    pictures = rerun.pictures_of_calibration() + len(_kinds(rerun)) * (len(chosen) + sides * request.fresh)
    if pictures > request.most_pictures:
        problem = f"the check would render {pictures} pictures, at most {request.most_pictures} are allowed"
        raise GearError(f"{request.record}: {problem}; raise --most-pictures, or lower --samples and --fresh")


def _static(record: Record) -> Iterator[Finding]:
    """Yields what the rules say about the record alone."""
    yield from (finding("note", f"not ranked alone: {line}") for line in faults([record]))
    yield from (finding("note", f"flag: {line}") for line in warnings([record]))


def _compare_built(rerun: Rerun, record: Record) -> Iterator[Finding]:
    """Yields findings about the task's metrics, the built network, and the defense's gradient and randomness."""
    entry, metric = record.entry, rerun.metric
    title, lower = ("", False) if metric is None else (metric.title, metric.lower_is_better)
    if (entry.task, entry.metric) != (rerun.planned.task_plugins.name, title):
        yield finding(
            "differs", f"{entry.task} by {entry.metric} in the record, the installed task is ranked by {title}"
        )
    if entry.lower_is_better != lower:
        yield finding("differs", f"{entry.metric}: the record and the task disagree on whether lower is better")
    if rerun.sample_metrics - {record.sample_metric}:
        names = ", ".join(sorted(rerun.sample_metrics))
        yield finding(
            "differs", f"samples: measured by {names or 'nothing'}, not by {record.sample_metric or 'nothing'}"
        )
    weights = rerun.guarded().weights_sha256
    if weights != record.entry.network.weights_sha256:
        yield finding("differs", "network: other weights than in the record")
    if rerun.planned.defense is None:
        return
    spec = rerun.planned.defense.chosen.found.spec
    if isinstance(spec, DefenseSpec) and spec.gradient != entry.gradient:
        yield finding("differs", f"defense: its gradient is {spec.gradient}, the record says {entry.gradient}")
    if rerun.guarded().is_random(rerun.pictures) and not record.entry.is_random:
        yield finding("differs", "defense: its results depend on its random generator, the record says they do not")


def _fresh(
    rerun: Rerun, request: CheckRequest, secret: Withheld | None, count: Callable[[Again], Again]
) -> Iterator[Finding]:
    """Yields the findings about samples that are not part of the benchmark."""
    seed = int(derive_rng(request.seed, "leaderboard", "fresh").integers(1 << 31)) if secret is None else secret.seed
    places = list(range(min(FRESH_PLACES, len(rerun.planned.pools[NONE]), request.fresh)))
    shares = {place: request.fresh // len(places) + (place < request.fresh % len(places)) for place in places}
    found = [
        count(one) for patch in _kinds(rerun) for place in places
        for one in rerun.fresh(patch, place, shares[place], seed)
    ]  # fmt: skip
    yield from compare_fresh(rerun.record, found, request.seed)
    if secret is not None and secret.places and rerun.planned.defense is not None:
        other = rerun.elsewhere((secret.places_setting,))
        defended, alone = (
            [one for patch in _kinds(rerun) for one in other.fresh(patch, 0, request.fresh, seed, with_defense=guarded)]
            for guarded in (True, False)
        )
        yield from compare_withheld(rerun.record, defended, alone, request.seed)


def _environment(rerun: Rerun) -> dict[str, str]:
    """Versions, renderer and device of this machine, with the keys of a record's environment."""
    device = str(getattr(rerun.guarded().model, "device", "cpu"))
    torch = {"torch": str(sys.modules["torch"].__version__)} if "torch" in sys.modules else {}
    facts = {f"renderer.{key}": value for key, value in rerun.renderer.items()}
    own = {"gear": importlib.metadata.version("mujoco-gear"), "python": platform.python_version(), "device": device}
    return {key: printable(str(value)) for key, value in (facts | versions() | torch | own).items()}


def _state(found: Sequence[Finding], *, is_whole: bool) -> State:
    if any(one.level == "differs" for one in found):
        return "differs"
    return "reproduced" if is_whole else "incomplete"
