"""Baselines of a search: a fitness for which paths are planned and nothing is driven."""
