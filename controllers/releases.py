"""The releases of Nav2 whose behaviour is built; the world below knows them, for its planners and costmaps."""

from gym_mapbench.releases import RELEASES, Release

__all__ = ["RELEASES", "Release"]
