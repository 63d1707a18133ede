"""The sections of a parameter file, each read key by key into the parameters of its node."""
