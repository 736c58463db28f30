"""Patches into pictures, differentiably. Never imported by what collects."""
