"""Configs: YAML read as text into typed, frozen dataclasses; every error says `file:line:column`."""
