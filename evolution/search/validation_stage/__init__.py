"""The validation stage: the best maps get held-out seeds before the best set of a search is named.

The set with the best fitness in a search is subject to selection bias (winner's curse). The stage therefore
re-evaluates the best maps on held-out seeds, at first only with the controller that sets scores apart. It selects the
set with the best mean trial, where a trial without the order of the maps gains nothing, and where a set that keeps the
order without a failure in less than nine in ten trials counts less. On the maps of this set all controllers drive, and
they get as many held-out seeds again, until the selection stays. Its held-out fitness is measured on further seeds,
which took no part in the selection.

With several objectives nothing is selected: the sets of the Pareto front are re-evaluated on held-out seeds.
"""

from __future__ import annotations

from evolution.search.validation_stage.front import FrontPoint, front_of, reevaluate
from evolution.search.validation_stage.held_out import ValidationResult
from evolution.search.validation_stage.stage import Validated, validate

__all__ = ["FrontPoint", "Validated", "ValidationResult", "front_of", "reevaluate", "validate"]
