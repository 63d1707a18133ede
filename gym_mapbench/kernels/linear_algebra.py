"""Squared-exponential correlations, and linear equations with a positive definite matrix.

LAPACK's bits depend on the processor and on its number of threads, and its threads wait for each other actively: on a
machine whose cores all drive, it takes up to a hundred times as long. These kernels have one order of additions.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def correlate(points, others, weights):
    """Return ``exp(-d / 2)``, where ``d`` is the weighted sum of the squared differences of two points.

    Args:
        points: ``(n, dimensions)``.
        others: ``(m, dimensions)``.
        weights: ``(dimensions,)``.

    Returns:
        ``(n, m)``.
    """
    found = np.empty((len(points), len(others)))
    for row in range(len(points)):
        for column in range(len(others)):
            distance = 0.0
            for dimension in range(len(weights)):
                apart = points[row, dimension] - others[column, dimension]
                distance += weights[dimension] * apart * apart
            found[row, column] = math.exp(-0.5 * distance)
    return found


@kernel
def cholesky(matrix):
    """Return the upper triangle ``U`` with ``U^T U = matrix``, which must be symmetric and positive definite.

    Args:
        matrix: ``(n, n)``; its upper triangle is read.

    Returns:
        ``(n, n)``, below the diagonal 0; NaN from where on the matrix is not positive definite.
    """
    size = len(matrix)
    upper = np.zeros((size, size))
    for number in range(size):
        row = upper[number]
        for column in range(number, size):
            row[column] = matrix[number, column]
        for other in range(number):
            above, factor = upper[other], upper[other, number]
            for column in range(number, size):
                row[column] -= factor * above[column]
        root = math.sqrt(row[number])
        for column in range(number, size):
            row[column] /= root
    return upper


@kernel
def solve_transposed(upper, right):
    """Return ``X`` with ``upper^T X = right``.

    Args:
        upper: ``(n, n)``, an upper triangle.
        right: ``(n, m)``.

    Returns:
        ``(n, m)``.
    """
    found = right.copy()
    for number in range(len(upper)):
        row = found[number]
        for column in range(len(row)):
            row[column] /= upper[number, number]
        for other in range(number + 1, len(upper)):
            below, factor = found[other], upper[number, other]
            for column in range(len(row)):
                below[column] -= factor * row[column]
    return found


@kernel
def solve_positive(upper, right):
    """Return ``x`` with ``upper^T upper x = right``.

    Args:
        upper: ``(n, n)``, an upper triangle.
        right: ``(n,)``.

    Returns:
        ``(n,)``.
    """
    found = solve_transposed(upper, right.copy().reshape(-1, 1)).reshape(-1)
    for row in range(len(upper) - 1, -1, -1):
        for known in range(row + 1, len(upper)):
            found[row] -= upper[row, known] * found[known]
        found[row] /= upper[row, row]
    return found
