"""Sweeps: the same controllers on the same maps in several worlds, and what each world changes.

A sweep is a study without a search: ``settings`` says which worlds, ``running`` drives and records, ``effects``
compares each world with the first, map by map.
"""
