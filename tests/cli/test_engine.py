from __future__ import annotations

import argparse

from gear.cli.engine import add_engine, add_engine_workers


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(exit_on_error=False)
    add_engine(made, "that makes the samples")
    add_engine_workers(made, "scenes")
    return made


def test_the_default_engine_has_one_worker_and_no_cluster() -> None:
    assert vars(parser().parse_args([])) == {"engine": None, "address": None, "engine_workers": 1}


def test_an_engine_its_cluster_and_its_workers_are_read() -> None:
    found = parser().parse_args(["--engine", "slurm", "--address", "gpu", "--engine-workers", "3"])
    assert vars(found) == {"engine": "slurm", "address": "gpu", "engine_workers": 3}


def test_the_help_says_what_the_engine_does() -> None:
    text = " ".join(parser().format_help().split())
    assert "engine that makes the samples: processes, ray or slurm" in text
    assert "number of scenes at the same time" in text
