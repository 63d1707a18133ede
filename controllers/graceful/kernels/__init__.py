"""The kernels of the Graceful Controller."""
