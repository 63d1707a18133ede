"""The releases of Nav2 that are modelled. ``gym_mapbench`` defines them, as its planners and costmaps need them too."""

from gym_mapbench.releases import RELEASES, Release

__all__ = ["RELEASES", "Release"]
