"""Learned policies with a card of their training: the encoding of observations, the card of a model, driving.

A model with a card drives through :class:`TrainedPolicy`; any other policy through :mod:`controllers.rl`.
"""

from __future__ import annotations

from controllers.learned.encoding import EncodingSettings, Features
from controllers.learned.memory import Sight
from controllers.learned.model_card import NO_CARD, ModelCard, Normalization, read_card, write_card
from controllers.learned.trained import TrainedPolicy

__all__ = [
    "NO_CARD",
    "EncodingSettings",
    "Features",
    "ModelCard",
    "Normalization",
    "Sight",
    "TrainedPolicy",
    "read_card",
    "write_card",
]
