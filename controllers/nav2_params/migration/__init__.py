"""Turns a parameter file of one distribution into one of another, and lists everything that was done.

Outdated names are replaced, classes are spelt as the release wants them, parameters whose default changed are written
out with the old value, and keys without a counterpart are taken out and listed. Comments and templates stay.

Source: Nav2's migration guides, and the tables of the controllers' own parameters.
"""

from controllers.nav2_params.migration.file import Migration, migrate_file

__all__ = ["Migration", "migrate_file"]
