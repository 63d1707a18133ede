"""What is known about the keys of a controller's section, besides what the controller's own module says about them.

These are names of older releases, parameters of releases newer than Jazzy, and keys that users' files often have.
"""

from __future__ import annotations

from collections.abc import Mapping

from controllers.nav2_params.keys import Keys
from controllers.releases import Release

SHIM = frozenset(
    {
        "angular_disengage_threshold",
        "angular_dist_threshold",
        "closed_loop",
        "forward_sampling_distance",
        "max_cost_threshold",
        "primary_controller",
        "rotate_to_goal_heading",
        "rotate_to_heading_once",
        "simulate_ahead_time",
        "use_path_orientations",
    }
)
"""Parameters of the Rotation Shim that its primary controller does not have."""
DWB = Keys()
GRACEFUL = Keys()
RPP = Keys(
    renamed={"max_allowed_time_to_collision": "max_allowed_time_to_collision_up_to_carrot"},
    elsewhere={
        "allow_obstacle_checking_beyond_goal": "the look-ahead ends at the carrot here",
        "use_approach_linear_velocity_scaling": "a parameter of older releases; the approach is always scaled now",
        "use_approach_vel_scaling": "a parameter of older releases; the approach is always scaled now",
    },
)
MPPI = Keys(
    ros_only=frozenset({"Visualization"}),
    elsewhere={
        "vy_min": "no release reads it; vy_max counts for both sides",
        "OptimalTrajectoryValidator": "the chosen trajectory is not checked once more here",
        "TwirlingCritic.twirling_cost_power": "an older name of cost_power",
        "TwirlingCritic.twirling_cost_weight": "an older name of cost_weight",
    },
)
OLD_CRITICS: Mapping[Release, Mapping[str, str]] = {"humble": {"PathAlignLegacyCritic": "PathAlignCritic"}, "jazzy": {}}
"""Release -> MPPI critic that only this one of the two has, and that is not built here -> the critic in its place."""
