"""Training: from an algorithm's settings and maps to a model that drives beside Nav2's controllers.

In: :class:`TrainSettings` (a YAML file per algorithm comes with the package), maps, and the levels of a curriculum.
Out: a directory with the learning curve, checkpoints, and the model that did best on held-out maps.
Stable-Baselines3 is needed for the learning alone and is imported when it begins.

It stands beside the studies: it needs maps, files, pictures and intervals, and nothing of a search.
"""

from __future__ import annotations

from evolution.training.directory import TRAINING, Training, TrainingDir, load_training
from evolution.training.learning import begin_training, learn
from evolution.training.record import TrainProgress
from evolution.training.settings import TrainSettings, algorithm_names, load_algorithm, train_settings

__all__ = [
    "TRAINING",
    "TrainProgress",
    "TrainSettings",
    "Training",
    "TrainingDir",
    "algorithm_names",
    "begin_training",
    "learn",
    "load_algorithm",
    "load_training",
    "train_settings",
]
