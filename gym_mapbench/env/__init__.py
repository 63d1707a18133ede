"""The Gymnasium environments over the world: task, action, observation, reward; one world or many."""
