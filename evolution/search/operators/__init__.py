"""Operators of the search over map sets: sampling, crossover, mutation, repair and duplicate elimination, for pymoo."""

from __future__ import annotations

from evolution.search.operators.adaptive import Trial
from evolution.search.operators.changes import OPERATORS
from evolution.search.operators.crossover import MapCrossover
from evolution.search.operators.duplicates import MapSetDuplicates
from evolution.search.operators.edits import Edit, Operator
from evolution.search.operators.gene_changes import GENE_OPERATORS, GeneEdit
from evolution.search.operators.mutation import MapMutation, Mutator
from evolution.search.operators.near_way import change_near_way
from evolution.search.operators.repair import MapRepair
from evolution.search.operators.sampling import Column, DrawMap, MapSampling, as_column, scenario_on
from evolution.search.operators.settings import MutationSettings

__all__ = [
    "GENE_OPERATORS",
    "OPERATORS",
    "Column",
    "DrawMap",
    "Edit",
    "GeneEdit",
    "MapCrossover",
    "MapMutation",
    "MapRepair",
    "MapSampling",
    "MapSetDuplicates",
    "MutationSettings",
    "Mutator",
    "Operator",
    "Trial",
    "as_column",
    "change_near_way",
    "scenario_on",
]
