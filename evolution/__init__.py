"""The search over env configs: operators, fitness, evaluation, studies and the command ``mapbench``."""
