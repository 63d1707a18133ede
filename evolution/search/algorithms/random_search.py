"""Random search: a baseline without variation; every generation is sampled, and the best sets survive."""

from __future__ import annotations

from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.population import Population

from evolution.search.algorithms.base import Algorithm


class RandomSearch(GA):  # type: ignore[misc]
    """A baseline without variation: every generation is sampled, and the best sets survive; one objective."""

    def _infill(self) -> Population:
        samples = self.initialization.sampling(self.problem, self.n_offsprings, random_state=self.random_state)
        return self.eliminate_duplicates.do(samples, self.pop)


RANDOM = Algorithm(RandomSearch, objectives=1, varies=False, elitist=True)
