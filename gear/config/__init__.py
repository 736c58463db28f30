"""Configs: YAML that is read into typed, frozen dataclasses; every error names `file:line:column`."""
