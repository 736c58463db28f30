"""Contracts: the protocols and specs that plugins and rooms agree on. Imports values only."""
