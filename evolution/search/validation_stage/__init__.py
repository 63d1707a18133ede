"""The validation stage: the best maps get held-out seeds before the best set of a search is named.

The set with the best fitness in a search is subject to selection bias (winner's curse). The stage therefore
re-evaluates the best maps on held-out seeds, in rounds after which half of the maps stay (sequential halving). Of
these maps it selects the reliable set with the best mean trial, where a trial without the order of the maps gains
nothing. The maps of this set get further held-out seeds, until the selection stays. Its held-out fitness is measured on
further seeds, which took no part in the selection.

With several objectives nothing is selected: the sets of the Pareto front are re-evaluated on held-out seeds.
"""

from __future__ import annotations

from evolution.search.validation_stage.front import FrontPoint, front_of, reevaluate
from evolution.search.validation_stage.held_out import ValidationResult
from evolution.search.validation_stage.stage import validate

__all__ = ["FrontPoint", "ValidationResult", "front_of", "reevaluate", "validate"]
