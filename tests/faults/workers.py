"""Controllers that do something to the process that drives them: that run may be lost, and no other."""

from __future__ import annotations

from evolution.driving.evaluator import Evaluator
from tests.evolution import fake_runs
from tests.evolution.driving.test_evaluator import jobs_of, plan_of
from tests.faults.inputs import End

HARMLESS = ("leaves_a_child", "returns_twice", "prints")
KINDS = ("kills", "exits", "raises", "wrong_type", "exits_at_once", "overflows", "closes_all", "hangs", *HARMLESS)


def try_one(kind: str, seed: int) -> End:
    """Drive a controller with a fault among others."""
    names = ["good", kind, *(f"other_{seed}_{n}" for n in range(4))]
    jobs = jobs_of(plan_of(*names))
    with Evaluator(fake_runs.misbehave, workers=2, timeout_s=5.0) as evaluator:
        results = dict(zip(names, evaluator.run(jobs), strict=True))
    lost = [name for name in names if results[name].outcome == "error"]
    if lost == ([] if kind in HARMLESS else [kind]):
        return End("no other run lost")
    return End("other runs lost", ", ".join(f"{name}: {results[name].reason}" for name in lost))
