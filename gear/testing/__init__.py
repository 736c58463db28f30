"""Tests for authors of plugins: contract classes to subclass, and fixtures. Public API; the contracts need pytest."""
