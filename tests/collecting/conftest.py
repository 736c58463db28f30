"""Fixtures of the verbs' tests."""

from __future__ import annotations

from tests.verbs.conftest import collect_small, collected, copy_small, install, small

__all__ = ["collect_small", "collected", "copy_small", "install", "small"]
