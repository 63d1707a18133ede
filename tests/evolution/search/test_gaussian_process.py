"""The Gaussian process: worked cases, a plain twin, and what its hyperparameters find."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evolution.search.gaussian_process import LENGTH, MEAN_SPREAD, SCALES, Evidence, GaussianProcess, prior_prediction
from gym_mapbench.kernels.linear_algebra import cholesky, solve_positive, solve_transposed

MEAN = 3.0


def samples(count, genes=2, runs=2, seed=0, noise=0.1, relevant=0):
    """Maps whose value depends on one gene, with some runs on each."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.0, 1.0, (count, genes))
    values = MEAN + 0.8 * np.sin(6.0 * places[:, relevant])
    return places, [list(value + noise * rng.normal(size=runs)) for value in values]


def plain(genes, values, at, own=None):
    """The posterior of one map by the textbook's formula, run by run, with the inverse of the covariance."""
    function, of_map, noise = SCALES
    width = np.ptp(genes, axis=0)
    owner = [number for number, some in enumerate(values) for _ in some]
    rows = [*(genes[number] for number in owner), at]
    owners = [*owner, -1 if own is None else own]

    def covariance(one, other):
        distance = np.sum(((rows[one] - rows[other]) / width / LENGTH) ** 2)
        found = MEAN_SPREAD**2 + function**2 * np.exp(-0.5 * distance)
        return found + (of_map**2 if owners[one] == owners[other] else 0.0)

    count = len(rows)
    whole = np.array([[covariance(one, other) for other in range(count)] for one in range(count)])
    known = whole[:-1, :-1] + noise**2 * np.eye(count - 1)
    weights = np.linalg.inv(known) @ whole[:-1, -1]
    observed = np.concatenate(values) - MEAN
    return MEAN + weights @ observed, np.sqrt(whole[-1, -1] - weights @ whole[:-1, -1])


@settings(max_examples=25, deadline=None)
@given(st.integers(2, 6), st.integers(1, 3), st.integers(0, 1000))
def test_the_prediction_is_that_of_the_plain_formula(count, runs, seed):
    genes, values = samples(count, runs=runs, seed=seed)
    process = GaussianProcess(Evidence(genes, values), MEAN)
    new, known = process.predict(np.array([[0.3, 0.6], genes[0]]), [None, 0])
    assert (new.mean, new.deviation) == pytest.approx(plain(genes, values, np.array([0.3, 0.6])))
    assert (known.mean, known.deviation) == pytest.approx(plain(genes, values, genes[0], own=0))


def test_runs_of_a_map_say_more_of_this_map_than_of_its_twin():
    genes, values = samples(8)
    own, twin = GaussianProcess(Evidence(genes, values), MEAN).predict(genes[[0, 0]], [0, None])
    assert own.deviation < twin.deviation
    assert abs(own.mean - np.mean(values[0])) < abs(twin.mean - np.mean(values[0]))


def test_many_runs_leave_no_doubt_of_a_map():
    genes, values = samples(5, runs=400)
    for number, one in enumerate(GaussianProcess(Evidence(genes, values), MEAN).predict(genes, range(5))):
        assert one.mean == pytest.approx(np.mean(values[number]), abs=0.01)
        assert one.deviation < 0.03


def test_far_from_all_maps_the_prior_is_left():
    genes, values = samples(4)
    (far,) = GaussianProcess(Evidence(genes, values), MEAN).predict(np.array([[90.0, 90.0]]), [None])
    prior = prior_prediction(MEAN)
    assert far.noise == pytest.approx(np.hypot(SCALES[1], SCALES[2]))
    assert prior.noise == SCALES[2]
    assert np.hypot(*SCALES[:2]) < far.deviation < prior.deviation


def test_the_fit_finds_the_gene_that_matters_and_predicts_better():
    genes, values = samples(60, genes=4, relevant=2)
    first = GaussianProcess(Evidence(genes, values), MEAN)
    fitted = first.fitted()
    lengths = fitted.evidence.parameters[:-3]
    assert int(np.argmin(lengths)) == 2
    places, truth = samples(200, genes=4, runs=1, seed=1, noise=0.0, relevant=2)

    def error(process):
        predictions = process.predict(places, [None] * len(places))
        return np.mean([abs(one.mean - some[0]) for one, some in zip(predictions, truth, strict=True)])

    assert error(fitted) < 0.7 * error(first)


def test_the_noise_is_that_of_the_runs_nearby():
    rng = np.random.default_rng(3)
    genes = np.linspace(0.0, 1.0, 40)[:, None]
    values = [list(MEAN + (0.6 if place < 0.5 else 0.05) * rng.normal(size=4)) for (place,) in genes]
    loud, quiet = GaussianProcess(Evidence(genes, values), MEAN).predict(np.array([[0.1], [0.9]]), [None, None])
    assert loud.noise > 1.4 * quiet.noise


def test_a_gene_that_all_maps_share_does_no_harm():
    genes, values = samples(12)
    same = np.c_[genes, np.ones(12)]
    without = GaussianProcess(Evidence(genes, values), MEAN).fitted().predict(genes, range(12))
    found = GaussianProcess(Evidence(same, values), MEAN).fitted().predict(same, range(12))
    np.testing.assert_allclose(np.array(found), np.array(without))


def test_evidence_gives_what_new_evidence_gives_whatever_it_was_asked_before():
    genes, values = samples(9)
    new = np.array([[0.3, 0.6], [0.1, 0.9]])
    kept = Evidence(genes, values)
    process = GaussianProcess(kept, MEAN)
    process.predict(genes, range(9))
    for at, known in ((new, [None, None]), (genes, [None] * 9), (genes, range(9)), (genes[:2], [0, 1]), (new, [0, 1])):
        for mean in (MEAN, 2.0):
            found = GaussianProcess(kept, mean).predict(at, known)
            assert found == GaussianProcess(Evidence(genes, values), mean).predict(at, known)


def test_evidence_is_of_its_runs_alone():
    genes, values = samples(4)
    evidence = Evidence(genes, values)
    assert evidence.is_of(genes.copy(), [list(some) for some in values], None)
    assert not evidence.is_of(genes, [*values[:3], [*values[3], MEAN]], None)
    assert not evidence.is_of(genes, [*values[:3], [MEAN, MEAN]], None)
    assert not evidence.is_of(genes + 0.1, values, None)
    assert not evidence.is_of(genes, values, evidence.parameters)


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 40), st.integers(1, 5), st.integers(0, 1000))
def test_the_equations_are_solved_as_by_lapack(size, columns, seed):
    rng = np.random.default_rng(seed)
    square, right = rng.normal(size=(size, size)), rng.normal(size=(size, columns))
    matrix = square @ square.T + np.eye(size)
    upper = cholesky(matrix)
    np.testing.assert_allclose(upper.T, np.linalg.cholesky(matrix), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(upper.T @ solve_transposed(upper, right), right, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(matrix @ solve_positive(upper, right[:, 0]), right[:, 0], rtol=1e-8, atol=1e-8)


def test_a_matrix_that_is_not_positive_definite_has_no_factor():
    assert np.isnan(cholesky(np.array([[1.0, 2.0], [2.0, 1.0]]))[1, 1])


@pytest.mark.slow
def test_predictions_depend_neither_on_the_number_of_cores_nor_on_vector_instructions():
    """LAPACK's and NumPy's do: of a factor from 150 maps on, and of ``exp``."""
    script = """
        import hashlib, numpy as np
        from evolution.search.gaussian_process import Evidence, GaussianProcess
        from tests.evolution.search.test_gaussian_process import MEAN, samples

        process = GaussianProcess(Evidence(*samples(200, genes=5)), MEAN).fitted()
        found = process.predict(np.random.default_rng(1).uniform(size=(30, 5)), [None] * 30)
        print(hashlib.sha256(np.array(found).tobytes()).hexdigest())
        """
    features = " ".join(np.show_config(mode="dicts")["SIMD Extensions"].get("found", []))
    machines = {"OPENBLAS_NUM_THREADS": "1"}, {"OPENBLAS_NUM_THREADS": "3", "NPY_DISABLE_CPU_FEATURES": features}
    command = [sys.executable, "-c", textwrap.dedent(script)]
    printed = [subprocess.check_output(command, env={**os.environ, **machine}) for machine in machines]
    assert printed[0] == printed[1] != b""
