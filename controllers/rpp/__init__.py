"""Regulated Pure Pursuit."""
