"""A campaign of faults: damaged files, workers that misbehave, searches that are killed.

``python -m tests.faults --minutes N`` runs it and prints a table of counts; the test run includes a short version.
"""
