"""NavigateToPose around a controller: behavior tree, recoveries, controller server, costmap servers."""
