"""Kernels: numba only; arrays and scalars in, arrays and scalars out."""
