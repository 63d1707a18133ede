"""The world: a map of walls, a robot with its sensors among them, and the physics that moves it."""
