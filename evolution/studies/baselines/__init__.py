"""Baselines of a search: a fitness of planned paths, without runs."""
