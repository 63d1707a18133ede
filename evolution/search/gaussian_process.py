"""Gaussian process regression of a value on the genes of maps, with replicated, noisy runs.

The value of a run is the sum of a mean, a smooth function of the map's genes, an effect of the single map, and noise.
The function has a squared-exponential kernel with one length scale for each gene (automatic relevance determination).
Source: Rasmussen and Williams, *Gaussian Processes for Machine Learning*, 2006, chapters 2 and 5; replicates as in
stochastic kriging (Ankenman, Nelson and Staum, 2010). Its bits depend neither on the processor nor on the number of
cores: kernels and ``math`` do what NumPy and LAPACK would do in another way on each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.linear_algebra import cholesky, correlate, solve_positive, solve_transposed

Array = NDArray[np.float64]

LENGTH, LENGTH_SPREAD = 0.5, 1.0
"""Prior of a length scale, in ranges of the gene: median, and standard deviation of the logarithm."""
SCALES, SCALES_SPREAD = (0.3, 0.15, 0.35), 0.5
"""Prior of the standard deviations of function, map and run: medians, and standard deviation of the logarithms."""
MEAN_SPREAD = 0.25
"""Standard deviation of the mean around the prior mean."""
STEPS = (0.5, 0.7, 1.4, 2.0)
"""Factors by which :meth:`GaussianProcess.fitted` changes one hyperparameter after the other."""
PRIOR_RUNS = 4.0
"""Runs as which the common noise counts beside the residuals of runs on maps nearby."""


class Prediction(NamedTuple):
    """What is predicted for one map.

    Args:
        mean: Posterior mean of the map's expected value.
        deviation: Posterior standard deviation of that value.
        noise: Standard deviation of the values of single runs around it.
    """

    mean: float
    deviation: float
    noise: float


class Toward(NamedTuple):
    """How some maps relate to those that have runs.

    Args:
        near: Correlation of the function, shape ``(maps, with runs)``.
        covariance: Covariance of the expected values, ``(maps, with runs)``.
        explained: Variance of each map's expected value that the runs take away, shape ``(maps,)``.
    """

    near: Array
    covariance: Array
    explained: Array


class Evidence:
    """The runs on some maps, and the covariances of these maps: all of a process that its prior mean does not change.

    Args:
        genes: Genes of the maps, shape ``(maps, genes)``.
        values: The values of the runs of each map.
        parameters: Length scales of the genes, and the standard deviations of function, map and run; None for the
            medians of their priors.

    Attributes:
        runs: Number of runs on each map.
        averages: Mean value of the runs on each map.
        factor: Cholesky factor of the covariance of these mean values.
        covariance: Covariance of mean and function on these maps.
    """

    def __init__(self, genes: Array, values: Sequence[Sequence[float]], parameters: Array | None = None) -> None:
        self._given = values, parameters
        self.genes = genes
        self.values = [np.array(some) for some in values]
        self.parameters = np.r_[np.full(genes.shape[1], LENGTH), SCALES] if parameters is None else parameters
        self.runs = np.array([float(len(some)) for some in values])
        self.averages = np.array([float(np.mean(some)) for some in values])
        width = np.ptp(genes, axis=0)
        self._width = np.where(width > 0.0, width, 1.0)
        self._answers: dict[bool, tuple[Array, list[int | None], Toward]] = {}
        self.covariance = self._covariance_with(self.parameters)
        self.factor = self._factor_of(self.covariance, self.parameters)

    def is_of(self, genes: Array, values: Sequence[Sequence[float]], parameters: Array | None) -> bool:
        """Return whether it was made of these genes and values, and of this very array of parameters."""
        return parameters is self._given[1] and values == self._given[0] and np.array_equal(genes, self.genes)

    def with_parameters(self, parameters: Array) -> Evidence:
        """Return the same runs with other hyperparameters."""
        return Evidence(self.genes, self._given[0], parameters)

    def toward(self, genes: Array, known: Sequence[int | None]) -> Toward:
        """Return how some maps relate to those that have runs.

        The last answers are kept: for maps of which some have runs, and for maps without.

        Args:
            genes: Their genes, shape ``(maps, genes)``.
            known: For each map its number among the maps that have runs; None for another map.
        """
        new, numbers = all(number is None for number in known), list(known)
        kept = self._answers.get(new)
        if kept is None or kept[1] != numbers or not np.array_equal(kept[0], genes):
            kept = self._answers[new] = genes, numbers, self._toward(genes, known)
        return kept[2]

    def _toward(self, genes: Array, known: Sequence[int | None]) -> Toward:
        near = self._correlation(genes, self.parameters)
        covariance = _covariance(near, self.parameters[-3])
        for row, number in enumerate(known):
            if number is not None:
                covariance[row, number] += self.parameters[-2] ** 2
        explained = np.square(solve_transposed(self.factor, np.ascontiguousarray(covariance.T))).sum(axis=0)
        return Toward(near, covariance, explained)

    def factor_with(self, parameters: Array) -> Array:
        """Return :attr:`factor` with other hyperparameters."""
        return self._factor_of(self._covariance_with(parameters), parameters)

    def _covariance_with(self, parameters: Array) -> Array:
        return _covariance(self._correlation(self.genes, parameters), parameters[-3])

    def _factor_of(self, covariance: Array, parameters: Array) -> Array:
        """Add the variances of map and run to a covariance of mean and function, and return the Cholesky factor."""
        factor: Array = cholesky(covariance + np.diag(parameters[-2] ** 2 + parameters[-1] ** 2 / self.runs))
        return factor

    def _correlation(self, genes: Array, parameters: Array) -> Array:
        """Return the correlation of some maps with those that have runs; length scales are in ranges of the genes."""
        near: Array = correlate(genes, self.genes, 1.0 / np.square(self._width * parameters[:-3]))
        return near


class GaussianProcess:
    """A Gaussian process with given hyperparameters, conditioned on runs.

    Args:
        evidence: The runs, and the hyperparameters.
        mean: Prior mean.
    """

    def __init__(self, evidence: Evidence, mean: float) -> None:
        self.evidence = evidence
        self.mean = mean
        self._rest = evidence.averages - mean
        self._weights: Array = solve_positive(evidence.factor, self._rest)
        self._residuals = self._squared_residuals()

    def fitted(self) -> GaussianProcess:
        """Return the process with more probable hyperparameters; each in turn is changed by the best of few factors."""
        own = self.evidence
        best, parameters = self._energy(own.parameters), own.parameters
        for number in range(len(parameters)):
            trials = [parameters * np.where(np.arange(len(parameters)) == number, step, 1.0) for step in STEPS]
            energies = [self._energy(trial) for trial in trials]
            if min(energies) < best:
                best, parameters = min(energies), trials[int(np.argmin(energies))]
        return GaussianProcess(own.with_parameters(parameters), self.mean)

    def predict(self, genes: Array, known: Sequence[int | None]) -> list[Prediction]:
        """Return the predictions for some maps.

        Args:
            genes: Their genes, shape ``(maps, genes)``.
            known: For each map its number among the maps that have runs; None for another map.
        """
        function, of_map, noise = self.evidence.parameters[-3:]
        near, covariance, explained = self.evidence.toward(genes, known)
        means = self.mean + _product(covariance, self._weights)
        variances = MEAN_SPREAD**2 + function**2 + of_map**2 - explained
        noises = PRIOR_RUNS * (noise**2 + of_map**2) + _product(near, self._residuals)
        noises = noises / (PRIOR_RUNS + _product(near, self.evidence.runs))
        columns = (means, np.sqrt(np.maximum(variances, 0.0)), np.sqrt(noises))
        return [Prediction(*map(float, row)) for row in zip(*columns, strict=True)]

    def _energy(self, parameters: Array) -> float:
        """Return the negative logarithm of the posterior density of hyperparameters, up to a constant."""
        factor = self.evidence.factor_with(parameters)
        scales = [math.log(one / LENGTH) / LENGTH_SPREAD for one in parameters[:-3].tolist()]
        pairs = zip(parameters[-3:].tolist(), SCALES, strict=True)
        scales += [math.log(one / middle) / SCALES_SPREAD for one, middle in pairs]
        misfit = float((self._rest * solve_positive(factor, self._rest)).sum())
        determinant = sum(map(math.log, np.diag(factor).tolist()))
        return 0.5 * misfit + determinant + 0.5 * sum(one * one for one in scales)

    def _squared_residuals(self) -> Array:
        """Return for each map that has runs the sum of the squares of its runs' differences from mean and function."""
        smooth = self.mean + _product(self.evidence.covariance, self._weights)
        return np.array([np.square(some - one).sum() for some, one in zip(self.evidence.values, smooth, strict=True)])


def prior_prediction(mean: float) -> Prediction:
    """Return the prediction for a map if no map of its kind has runs."""
    function, of_map, noise = SCALES
    return Prediction(mean, float(np.hypot(MEAN_SPREAD, np.hypot(function, of_map))), noise)


def _covariance(correlation: Array, function: float) -> Array:
    """Return the covariance of mean and function; ``function`` is the standard deviation of the latter."""
    return MEAN_SPREAD**2 + function**2 * correlation


def _product(matrix: Array, vector: Array) -> Array:
    """Return the product of a matrix and a vector, summed in the order of NumPy, not of BLAS."""
    product: Array = (matrix * vector).sum(axis=1)
    return product
