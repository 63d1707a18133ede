"""Sweeps: the same controllers on the same maps in several worlds, and the effect of each world.

A sweep is a study without a search: ``settings`` describes the worlds, ``running`` runs and records, ``effects``
compares each world with the first, map by map.
"""
