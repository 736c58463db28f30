"""Contracts: the protocols and specs of plugins, and those between gear's packages. Imports `gear.values` only."""
