"""Kernels of DWB: arrays and scalars only."""
