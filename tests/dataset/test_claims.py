"""Claims: one run makes a sample at a time, and those of killed runs are taken over."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from gear.contracts.executors import Outcome
from gear.dataset import scratch
from gear.dataset.claims import OLD_S, Claims, clear_claims
from gear.dataset.layout import claim_path, sidecar_path
from gear.values.errors import DatasetError
from tests.dataset.splits import fill, plan, tree

HOLD = """
import sys, time
from pathlib import Path
from gear.dataset.claims import Claims
assert Claims(Path(sys.argv[1]), "test").take(3)
print("held", flush=True)
time.sleep(60)
"""


def holder(root: Path) -> subprocess.Popen[str]:
    """Another process that holds the claim on sample 3."""
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(root)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "held\n"
    return process


@pytest.fixture
def no_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system without locks."""

    def refuse(*_: object) -> None:
        raise OSError(errno.ENOTSUP, "no locks")

    monkeypatch.setattr(scratch.fcntl, "flock", refuse)


def test_a_claim_is_held_by_one_and_leaves_nothing(tmp_path: Path) -> None:
    with Claims(tmp_path, "test") as first, Claims(tmp_path, "test") as second:
        assert first.take(3) and not second.take(3) and second.take(4)
        assert second.is_taken(3) and not second.is_taken(5)
        first.release(3)
        assert second.take(3)
    assert tree(tmp_path) == {}


def test_the_claim_of_a_killed_run_is_taken_over(tmp_path: Path) -> None:
    process = holder(tmp_path)
    with Claims(tmp_path, "test") as claims:
        assert not claims.take(3)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        assert (tmp_path / claim_path("test", 3)).exists() and claims.take(3)


def test_without_locks_the_claim_of_a_process_that_is_gone_is_taken_over(tmp_path: Path, no_locks: None) -> None:
    process = holder(tmp_path)
    with Claims(tmp_path, "test") as claims:
        assert not claims.take(3), "the process runs"
        process.kill()
        process.communicate()
        assert claims.take(3)


def test_without_locks_the_old_claim_of_another_machine_is_taken_over(tmp_path: Path, no_locks: None) -> None:
    path = tmp_path / claim_path("test", 3)
    path.parent.mkdir(parents=True)
    path.write_text("another-machine-77-0123456789abcdef")
    with Claims(tmp_path, "test") as claims:
        assert not claims.take(3)
        old = path.stat().st_mtime - OLD_S - 1
        os.utime(path, (old, old))
        assert claims.take(3)


def test_without_locks_the_old_claim_of_a_reused_process_number_is_taken_over(tmp_path: Path, no_locks: None) -> None:
    path = tmp_path / claim_path("test", 3)
    path.parent.mkdir(parents=True)
    path.write_text(f"{scratch._host()}-{os.getppid()}-0123456789abcdef")
    with Claims(tmp_path, "test") as claims:
        assert not claims.take(3) and claims.holder(3) == f"process {os.getppid()} on {scratch._host()}"
        old = path.stat().st_mtime - OLD_S - 1
        os.utime(path, (old, old))
        assert claims.take(3)


@pytest.mark.parametrize("text", ["", "a\x1b[2J-7-ab", "host-x-ab", "host"])
def test_a_claim_that_names_no_process_is_another_runs(text: str, tmp_path: Path) -> None:
    path = tmp_path / claim_path("test", 3)
    path.parent.mkdir(parents=True)
    path.write_text(text)
    assert Claims(tmp_path, "test").holder(3) == "another run" == Claims(tmp_path, "test").holder(4)


def test_samples_that_are_made_or_claimed_are_left_out(tmp_path: Path) -> None:
    fill(tmp_path, plan(samples=5), [1], is_closed=False)
    reported: list[Outcome] = []
    with Claims(tmp_path, "test") as other, Claims(tmp_path, "test") as claims:
        assert other.take(2)
        assert list(claims.unclaimed(range(5), reported.append)) == [0, 3, 4]
        assert [(one.index, one.kind) for one in reported] == [(1, "elsewhere"), (2, "elsewhere")]
        assert other.is_taken(0) and not other.is_taken(1)


def test_left_claims_are_cleared_and_held_ones_stay(tmp_path: Path) -> None:
    for index in (1, 2):
        path = tmp_path / claim_path("test", index)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("of a killed run")
    with Claims(tmp_path, "test") as claims:
        assert claims.take(2)
        clear_claims(tmp_path, "test")
        assert [path.name for path in path.parent.iterdir()] == ["000002.claim"]
    clear_claims(tmp_path, "test")
    assert not path.parent.exists()


def test_a_claim_is_written_through_no_link(tmp_path: Path) -> None:
    victim, path = tmp_path / "victim", tmp_path / "out" / claim_path("test", 3)
    victim.write_text("mine")
    path.parent.mkdir(parents=True)
    path.symlink_to(victim)
    with Claims(tmp_path / "out", "test") as claims, pytest.raises(DatasetError, match="is a link"):
        claims.take(3)
    assert victim.read_text() == "mine"


def test_a_claim_is_written_into_no_hard_link_and_no_fifo(tmp_path: Path) -> None:
    victim, out = tmp_path / "victim", tmp_path / "out"
    victim.write_text("mine")
    (out / claim_path("test", 3)).parent.mkdir(parents=True)
    (out / claim_path("test", 3)).hardlink_to(victim)
    os.mkfifo(out / claim_path("test", 4))
    before = len(list(Path("/proc/self/fd").iterdir())) if Path("/proc/self/fd").is_dir() else 0
    with Claims(out, "test") as claims:
        with pytest.raises(DatasetError, match=r"000003\.claim: is a hard link"):
            claims.take(3)
        with pytest.raises(DatasetError, match=r"000004\.claim: is no regular file"):
            claims.take(4)
        if before:
            assert len(list(Path("/proc/self/fd").iterdir())) == before, "no descriptor is left open"
    with pytest.raises(DatasetError, match="is a hard link"):
        clear_claims(out, "test")
    assert victim.read_text() == "mine"


def test_a_root_that_is_missing_on_this_machine_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(
        DatasetError, match=r"none: is not there on this machine.*--out that all of them share"
    ) as caught:
        Claims(tmp_path / "none", "test").take(3)
    assert "\n" not in str(caught.value) and not (tmp_path / "none").exists()


def test_closing_a_split_clears_its_claims_and_notes(tmp_path: Path) -> None:
    fill(tmp_path / "clean", plan())
    for kind in ("claims/000001.claim", "failed/000001.json"):
        path = tmp_path / "out/gear/test" / kind
        path.parent.mkdir(parents=True)
        path.write_text("{}")
    fill(tmp_path / "out", plan())
    assert tree(tmp_path / "out") == tree(tmp_path / "clean")
    assert sidecar_path("test", 0) in tree(tmp_path / "out")
