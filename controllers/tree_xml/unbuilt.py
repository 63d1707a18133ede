"""Nodes of Nav2 and BehaviorTree.CPP that are not built here, and attributes of nodes that are not: why."""

from __future__ import annotations

NO_ROUTES = "there is no route server here"
ONE_GOAL = "there is one goal here, not several"
NO_SCRIPTS = "scripts are not built here"
OF_LIBRARY = "a node of BehaviorTree.CPP that is not built here"
NO_POSES = "poses other than the goal are not built here"

UNBUILT = {
    **dict.fromkeys(
        (
            "ComputeRoute",
            "ComputeAndTrackRoute",
            "CancelComputeAndTrackRoute",
            "ExtractRouteNodesAsGoals",
            "WouldARouteRecoveryHelp",
        ),
        NO_ROUTES,
    ),
    **dict.fromkeys(
        (
            "ComputePathThroughPoses",
            "NavigateThroughPoses",
            "RemovePassedGoals",
            "RemoveInCollisionGoals",
            "GetNextFewGoals",
            "AppendGoalPoseToGoals",
        ),
        ONE_GOAL,
    ),
    **dict.fromkeys(
        (
            "GetPoseFromPath",
            "GetCurrentPose",
            "ArePosesNear",
            "ConcatenatePaths",
            "ClearCostmapAroundPose",
            "IsPoseOccupied",
        ),
        NO_POSES,
    ),
    **dict.fromkeys(("AssistedTeleop", "CancelAssistedTeleop"), "nobody steers the robot here"),
    **dict.fromkeys(("Script", "ScriptCondition", "Precondition"), NO_SCRIPTS),
    **dict.fromkeys(
        (
            "AsyncFallback",
            "AsyncSequence",
            "BlackboardCheckBool",
            "BlackboardCheckDouble",
            "BlackboardCheckInt",
            "BlackboardCheckString",
            "IfThenElse",
            "LoopBool",
            "LoopDouble",
            "LoopInt",
            "LoopString",
            "ManualSelector",
            "ParallelAll",
            "RunOnce",
            "SkipUnlessUpdated",
            "Sleep",
            "Switch2",
            "Switch3",
            "Switch4",
            "Switch5",
            "Switch6",
            "UnsetBlackboard",
            "WaitValueUpdate",
            "WasEntryUpdated",
            "WhileDoElse",
        ),
        OF_LIBRARY,
    ),
    "NavigateToPose": "a tree that starts another tree is not built here",
    "ReinitializeGlobalLocalization": "there is no global localisation to start here",
}
"""Nodes that some release has -> why a tree with them is refused."""

CONDITIONS = frozenset(
    {"_skipIf", "_successIf", "_failureIf", "_while", "_onSuccess", "_onFailure", "_onHalted", "_post"}
)
"""Attributes by which BehaviorTree.CPP 4 gives a node a precondition or a postcondition, which are scripts."""
