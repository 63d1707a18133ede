"""Kernels of MPPI: arrays and scalars only."""
