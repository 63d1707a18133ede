"""What is measured of a recorded run (:class:`Episode`), and of a map."""

from gym_mapbench.metrics.episode import RECOVERY_KINDS, Episode, Event, Outcome
from gym_mapbench.metrics.run_metrics import METRICS, measure, score_barn

__all__ = ["METRICS", "RECOVERY_KINDS", "Episode", "Event", "Outcome", "measure", "score_barn"]
