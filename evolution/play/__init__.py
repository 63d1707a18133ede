"""The playground: draw a map, change a parameter, and see what the controllers do.

In: maps, parameters and controllers of the command line, and messages of a page in the browser. Out: the runs, their
results and what the robots believe, computed by the same code as ``mapbench bench`` and ``mapbench drive``.
"""

from __future__ import annotations

from evolution.play.messages.requests import AskRandom, WorldSettings
from evolution.play.scenes import sampled, scene_of
from evolution.play.server import Beginning, export_session, serve
from evolution.play.worlds import FILE, Given

__all__ = ["FILE", "AskRandom", "Beginning", "Given", "WorldSettings", "export_session", "sampled", "scene_of", "serve"]
