"""Operators on genes: what each changes, and that the search keeps genomes with their maps."""

from __future__ import annotations

import numpy as np
import pytest

from evolution.search.operators.gene_changes import GENE_OPERATORS, GeneEdit, StepSettings
from evolution.search.operators.mutation import MapMutation, Mutator
from evolution.search.operators.sampling import as_column, scenario_of, scenario_on
from evolution.search.operators.settings import MutationSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import FamilySpec, ShapeSettings, build_genome, draw_from, make_family
from gym_mapbench.world.scenario import MapSet
from tests.evolution.fake_runs import WAFFLE

THESIS = ShapeSettings()
GATES = FamilySpec(name="gates", options={"count": [1, 4], "deviation": [0.05, 0.15]})
SEEDS = range(40)


def edit(name="gates", seed=0, mates=2, **options):
    """Genes with the genes of other maps."""
    family = make_family(name, **options)
    rng = np.random.default_rng(seed)
    genes, *others = (family.draw_genes(rng) for _ in range(1 + mates))
    return GeneEdit(genes, family, StepSettings(), others)


def changed(operator, one, seed):
    return GENE_OPERATORS[operator](one, np.random.default_rng(seed))


@pytest.mark.parametrize("operator", GENE_OPERATORS.built_in)
@pytest.mark.parametrize("family", ["gates", "bends", "sequences"])
def test_every_operator_leaves_genes_that_make_a_map(operator, family):
    for seed in range(8):
        one = edit(family, seed)
        genes = changed(operator, one, seed)
        assert one.family.build(genes, THESIS).shape == (150, 150)
        assert changed(operator, one, seed) == genes
        for section in genes.sections:
            motif = one.family.motif(section.motif)
            assert motif.count[0] <= len(section.elements) <= motif.count[1]
            assert all(low <= section.shared[gene] <= high for gene, (low, high) in motif.ranges.items())


def test_a_step_of_shared_genes_leaves_the_elements():
    sizes = []
    for seed in SEEDS:
        one = edit(seed=seed)
        genes = changed("step_shared", one, seed)
        (before,), (after,) = one.genes.sections, genes.sections
        assert after.elements == before.elements
        assert genes.route == one.genes.route
        for gene, (low, high) in one.family.ranges.items():
            if after.shared[gene] != before.shared[gene]:
                sizes.append(abs(after.shared[gene] - before.shared[gene]) / (high - low))
    assert len(sizes) > 2 * len(SEEDS)
    assert 0.03 < np.mean(sizes) < 0.12


@pytest.mark.parametrize(("operator", "by"), [("add_element", 1), ("duplicate_element", 1), ("remove_element", -1)])
def test_the_number_of_elements_changes_by_one_within_its_range(operator, by):
    for seed in SEEDS:
        one = edit(seed=seed)
        (before,), (after,) = one.genes.sections, changed(operator, one, seed).sections
        low, high = one.family.count
        assert len(after.elements) == min(high, max(low, len(before.elements) + by))
        assert after.shared == before.shared
        if operator == "duplicate_element":
            assert all(element in before.elements for element in after.elements)


@pytest.mark.parametrize(("operator", "genes"), [("step_element", 1), ("shift_element", 2)])
def test_one_element_deviates_otherwise(operator, genes):
    for seed in SEEDS:
        one = edit(seed=seed, count=(3, 3))
        pairs = zip(one.genes.sections[0].elements, changed(operator, one, seed).sections[0].elements, strict=True)
        differing = [[gene for gene in old if old[gene] != new[gene]] for old, new in pairs if old != new]
        assert len(differing) == 1
        assert len(differing[0]) == genes


def test_deviations_shrink_by_one_factor():
    one = edit(count=(3, 3))
    before, after = one.genes.sections[0].elements, changed("shrink_deviations", one, 1).sections[0].elements
    factors = [new[gene] / old[gene] for old, new in zip(before, after, strict=True) for gene in old]
    assert 0 <= factors[0] < 1
    assert np.allclose(factors, factors[0])


@pytest.mark.parametrize("family", ["gates", "bends", "pillar_rows"])
def test_straight_elements_are_equal_and_on_the_route(family):
    one = edit(family, count=(3, 3), **({"swing": (0.1, 0.3)} if family == "bends" else {}))
    (before,), (after,) = one.genes.sections, changed("straighten", one, 1).sections
    least = {"shift": 0.0, "slope": 0.0, "swing": one.family.swing[0]}
    assert after.shared == {**before.shared, **least} != before.shared
    assert after.elements == ({}, {}, {})
    again = changed("straighten", GeneEdit(one.genes.replace(sections=(after,)), one.family, one.settings), 2)
    assert again.sections == (after,)


def test_crossover_takes_genes_from_one_mate():
    for seed in SEEDS:
        one = edit(seed=seed, mates=1, count=(3, 3))
        (ours,), (theirs,) = one.genes.sections, one.mates[0].sections
        shared = changed("cross_shared", one, seed).sections[0]
        assert shared.elements == ours.elements
        assert all(shared.shared[gene] in (ours.shared[gene], theirs.shared[gene]) for gene in ours.shared)
        crossed = changed("cross_elements", one, seed).sections[0]
        assert crossed.shared == ours.shared
        assert all(new in pair for new, *pair in zip(crossed.elements, ours.elements, theirs.elements, strict=True))
    alone = edit(mates=0)
    assert changed("cross_shared", alone, 0) == changed("cross_elements", alone, 0) == alone.genes


def test_a_route_changes_alone():
    routes = set()
    for seed in SEEDS:
        one = edit(seed=seed)
        genes = changed("change_route", one, seed)
        assert genes.sections == one.genes.sections
        routes.add(genes.route.name)
    assert routes == {"diagonal", "straight", "bent"}


def sampled(rng, spec=GATES):
    return scenario_of(draw_from(rng, [spec], THESIS, WAFFLE), THESIS)


def test_a_mutated_map_is_the_map_of_its_genome():
    rng = np.random.default_rng(1)
    mutation = MapMutation(Mutator(THESIS, MutationSettings(probability=1.0, maps="one", drivable=True), WAFFLE))
    sets = as_column([MapSet((sampled(rng), sampled(rng))) for _ in range(3)])
    for _ in range(5):
        before, sets = sets, mutation._do(None, sets, random_state=rng)
        for (old,), (new,) in zip(before, sets, strict=True):
            assert sum(a.map != b.map for a, b in zip(old, new, strict=True)) == 1
            for scenario in new:
                assert np.array_equal(build_genome(scenario.genome, THESIS), scenario.map.occupancy)


def test_cells_of_a_map_with_a_genome_stay_and_a_new_map_has_its_own_genome():
    rng = np.random.default_rng(2)
    none = {f"{name}_probability": 0.0 for name in ("move", "scale", "remove", "add")}
    new = Mutator(THESIS, MutationSettings(**none, operators={"redraw": 1.0}), WAFFLE, (GATES,))
    scenario, names = new.vary(sampled(rng, FamilySpec(name="baffles")), rng)
    assert names == ("redraw",)
    assert scenario.genome.family == "gates"
    mixed = MutationSettings(**{**none, "move_probability": 0.8}, operators={"redraw": 0.2}, genes={"operators": ONE})
    assert Mutator(THESIS, mixed, WAFFLE).probabilities(scenario) == {"redraw": 0.2, "step_shared": 0.8}
    plain = scenario_on(scenario.map.occupancy, THESIS)
    assert Mutator(THESIS, mixed, WAFFLE).probabilities(plain)["move"] == 0.8
    assert plain == scenario
    assert plain.digest == scenario.digest


ONE = {"step_shared": 1.0}


def test_options_of_genes_are_written_only_if_they_differ():
    assert "genes" not in MutationSettings().model_dump(mode="json")
    options = MutationSettings(genes={"step": 0.1}).model_dump(mode="json")
    assert MutationSettings.from_mapping(options, "mutation").genes.step == 0.1
    with pytest.raises(ConfigError, match="expected probabilities whose sum is 1, got a sum of 0"):
        MutationSettings(genes={"operators": {"step_shared": 0.5}})
    with pytest.raises(ConfigError, match="did you mean 'step_shared'"):
        MutationSettings(genes={"operators": {"step_shard": 1.0}})
