"""Controllers that damage the worker process that runs them: their own run may be lost, and no other."""

from __future__ import annotations

from evolution.driving.evaluator import Evaluator
from tests.evolution.driving.test_evaluator import jobs_of, plan_of
from tests.faults import misbehaviour
from tests.faults.inputs import End

HARMLESS = ("leaves_a_child", "returns_twice", "prints", *misbehaviour.HARMLESS)
COSTLY = (
    *("kills", "exits", "raises", "wrong_type", "exits_at_once", "overflows", "closes_all", "hangs"),
    *("holds_the_lock", "leaves_a_child_and_hangs", "answers_too_much", "answers_with_something_else"),
    *misbehaviour.FAULTS,
)
KINDS = (*COSTLY, *HARMLESS)
TIMEOUT_SECONDS = 5.0


def try_one(kind: str, seed: int, executor: str = "processes") -> End:
    """Run a controller with a fault among five others on an executor; returns whether another run was lost."""
    names = ["good", kind, *(f"other_{seed}_{n}" for n in range(4))]
    jobs = jobs_of(plan_of(*names))
    with Evaluator(
        misbehaviour.misbehave, workers=2, timeout_s=TIMEOUT_SECONDS, retries=0, executor=executor
    ) as evaluator:
        results = dict(zip(names, evaluator.run(jobs), strict=True))
    lost = [name for name in names if results[name].outcome == "error"]
    unreadable = [name for name in lost if not results[name].reason.isprintable()]
    if unreadable:
        return End("not one line", repr(results[unreadable[0]].reason))
    if lost == ([] if kind in HARMLESS else [kind]):
        return End("no other run lost")
    return End("other runs lost", ", ".join(f"{name}: {results[name].reason}" for name in lost) or f"{kind}: goal")
