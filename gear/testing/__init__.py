"""Tests for authors of plugins: contract classes to subclass, and fixtures. It is public API; contracts need pytest."""
