"""Nav2's local navigation on Box2D grid maps, as a Gymnasium environment."""
