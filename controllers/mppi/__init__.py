"""MPPI, Nav2's Model Predictive Path Integral controller."""
