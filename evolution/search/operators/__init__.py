"""Sampling, crossover, mutation, repair and duplicate elimination over map sets, as pymoo operators."""
