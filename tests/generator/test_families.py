"""Families of maps: what their options and genes mean, how they are named, and what is drawn of them."""

from __future__ import annotations

import hashlib

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gym_mapbench  # noqa: F401, registers the env
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.generator import (
    FAMILIES,
    FamilySpec,
    MotifGenes,
    ShapeSettings,
    draw_from,
    draw_map,
    draw_obstacle,
    draw_shape,
    interior,
    is_drivable,
    make_family,
    sample_map,
    stamp,
    task_cells,
)
from gym_mapbench.generator.base import mirrored, wall_rows
from gym_mapbench.generator.doors import Doors
from gym_mapbench.generator.motifs import Motif
from gym_mapbench.generator.sampling import cut_piece
from gym_mapbench.metrics.map_metrics import narrowest_passage
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot

THESIS = ShapeSettings()
WAFFLE, BURGER = make_robot("turtlebot3_waffle"), make_robot("turtlebot3_burger")
ENDS = task_cells((150, 150), 11)
seeds = st.integers(0, 2**32 - 1)


def built(name, seed, **options):
    """Genes and map of one draw, drivable or not."""
    family = make_family(name, **options)
    genes = family.draw_genes(np.random.default_rng(seed))
    return genes, family.build(genes, THESIS)


def runs(line):
    """Lengths of the runs of free cells in a row of cells."""
    edges = np.flatnonzero(np.diff(np.concatenate(([1], line.astype(int), [1]))))
    return (edges[1::2] - edges[::2]).tolist()


def test_random_shapes_are_drawn_as_ever():
    digest = hashlib.blake2b(digest_size=8)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        digest.update(draw_map(rng, THESIS, (), WAFFLE).tobytes())
        digest.update(rng.bytes(8))
    assert digest.hexdigest() == "e30bc6f0977f1f74"


@given(seeds, st.integers(1, 4), st.floats(0.3, 2.0))
@settings(max_examples=60)
def test_every_wall_has_one_door_as_wide_as_asked(seed, walls, gap):
    genes, cells = built("doors", seed, walls=(walls, walls), gap=(gap, gap))
    upright = mirrored(cells) if genes.mirrored else cells
    rows = wall_rows(THESIS, genes.thickness, [door.place for door in genes.doors])
    assert len(rows) == walls
    for lines in rows:
        assert all(runs(line) == [round(gap / 0.05)] for line in upright[lines])
    between = np.ones(150, bool)
    for lines in rows:
        between[lines] = False
    assert not upright[between][1:-1, 1:-1].any()


@pytest.mark.parametrize(("robot", "narrowest"), [(WAFFLE, 0.55), (BURGER, 0.3)])
def test_the_narrowest_door_is_one_that_noise_leaves_open(robot, narrowest):
    rng, options = np.random.default_rng(0), {"gap": [0.2, 0.6], "walls": [1, 1]}
    for _ in range(30):
        cells = draw_from(rng, [FamilySpec(name="doors", options=options)], THESIS, robot).cells
        assert narrowest <= round(narrowest_passage(GridMap(cells, 0.05), *ENDS), 6) <= 0.6
    for gap, open_to_waffle in ((0.45, False), (0.5, False), (0.55, True)):
        cells = built("doors", 1, gap=(gap, gap), walls=(1, 1))[1]
        assert is_drivable(cells, THESIS, WAFFLE) == open_to_waffle
        assert is_drivable(cells, THESIS, BURGER)


@given(seeds)
@settings(max_examples=30)
def test_pillars_stand_in_rows_of_one_pitch(seed):
    genes, cells = built("pillars", seed, stagger=(0.0, 0.0))
    assert 0.8 <= genes.pitch <= 1.4
    assert 0.15 <= genes.side <= 0.4
    pitch, side = round(genes.pitch / 0.05), round(genes.side / 0.05)
    middle = interior(cells, 1)[22:-22, 22:-22]  # no cleared areas
    for along in (middle.any(axis=0), middle.any(axis=1)):
        assert (along[:-pitch] == along[pitch:]).all()
        assert set(runs(along)[1:-1]) == {pitch - side}
    assert np.array_equal(middle, np.outer(middle.any(axis=1), middle.any(axis=0)))


def test_every_other_row_of_pillars_is_shifted():
    options = {"pitch": (1.0, 1.0), "side": (0.2, 0.2), "x": (0.5, 0.5), "y": (0.5, 0.5), "stagger": (0.25, 0.25)}
    cells = built("pillars", 0, **options)[1]
    assert np.argwhere(cells[70] & (np.arange(150) % 149 > 0))[:3, 0].tolist() == [10, 11, 12]
    assert np.argwhere(cells[50] & (np.arange(150) % 149 > 0))[:3, 0].tolist() == [15, 16, 17]


@given(seeds, st.floats(0.3, 1.0), st.integers(1, 5))
@settings(max_examples=40)
def test_corridors_are_as_wide_as_asked(seed, width, flights):
    genes, cells = built("corridors", seed, width=(width, width), flights=(flights, flights))
    assert len(genes.flights) == flights
    narrowest = narrowest_passage(GridMap(cells, 0.05), *ENDS) / 0.05
    wanted = round(width / 0.05)
    assert narrowest == pytest.approx(wanted) if flights == 1 else narrowest >= wanted - 1e-9


@given(seeds, st.integers(2, 5))
@settings(max_examples=40)
def test_slaloms_alternate(seed, baffles):
    genes, cells = built("slaloms", seed, baffles=(baffles, baffles), reach=(0.5, 0.8))
    upright = mirrored(cells) if genes.mirrored else cells
    rows = wall_rows(THESIS, genes.thickness, [baffle.place for baffle in genes.baffles])
    for number, (lines, baffle) in enumerate(zip(rows, genes.baffles, strict=True)):
        line = interior(upright, 1)[lines.start - 1]
        from_left = genes.left_first == (number % 2 == 0)
        assert line[0] == from_left
        assert line[-1] != from_left
        assert line.sum() == round(baffle.reach * 150) - 1


def test_traps_open_towards_the_start_and_stand_on_the_straight_way():
    for seed in range(20):
        options = {"traps": (1, 1), "aside": (0.0, 0.0), "place": (0.5, 0.5), "width": (1.0, 2.0)}
        genes, cells = built("u_traps", seed, **options)
        (trap,) = genes.traps
        upright = mirrored(cells) if trap.opens_right else cells
        occupied = np.argwhere(interior(upright, 1))
        low, high = occupied.min(axis=0), occupied.max(axis=0)
        height, width = high - low + 1
        assert (height, width) == (round(trap.depth / 0.05), round(trap.width / 0.05))
        assert np.abs((low + high + 2) / 2 - 74.5).max() <= 1
        back, opening = interior(upright, 1)[high[0]], interior(upright, 1)[low[0]]
        assert back.sum() == width
        assert opening.sum() == 2 * round(genes.thickness / 0.05)


def test_sparse_maps_are_sparse():
    shares = [built("sparse", seed)[1].mean() for seed in range(50)]
    assert 0.02 < np.mean(shares) < 0.09


@given(seeds)
def test_mirroring_keeps_start_and_goal(seed):
    cells = np.random.default_rng(seed).random((30, 30)) < 0.3
    for end in task_cells((30, 30), 4):
        assert mirrored(cells)[end] == cells[end]
    assert np.array_equal(mirrored(mirrored(cells)), cells)
    assert not np.array_equal(mirrored(cells), cells)


def test_a_mixture_draws_of_all_its_families():
    specs = EnvConfig(family=["doors", "pillars", "shapes"]).family
    drawn = [draw_from(np.random.default_rng(seed), specs, THESIS, WAFFLE).family for seed in range(30)]
    assert set(drawn) == {"doors", "pillars", "shapes"}


def test_a_random_obstacle_is_a_shape_or_a_piece_of_a_family():
    rng, again = np.random.default_rng(4), np.random.default_rng(4)
    shape, *_ = draw_obstacle(rng, THESIS, (), (148, 148))
    assert np.array_equal(shape, draw_shape(again, THESIS))
    for seed in range(20):
        piece, row, col = draw_obstacle(np.random.default_rng(seed), THESIS, [FamilySpec(name="pillars")], (148, 148))
        assert 0 < piece.sum() < piece.size
        assert max(piece.shape) <= 30
        stamp(np.zeros((148, 148), bool)[row:, col:], piece, 0, 0)


@given(seeds, st.integers(1, 12))
def test_a_piece_of_a_map_is_where_it_was(seed, side):
    rng = np.random.default_rng(seed)
    cells = rng.random((9, 11)) < 0.1
    piece, row, col = cut_piece(rng, cells, side)
    assert max(piece.shape) <= side
    assert np.array_equal(piece, cells[row : row + piece.shape[0], col : col + piece.shape[1]])
    assert piece.any() == cells.any()


def test_the_env_draws_of_the_family():
    first, again, other = (MapBenchEnv(family="doors", observation=("pose",)) for _ in range(3))
    for env, seed in ((first, 1), (again, 1), (other, 2)):
        env.reset(seed=seed)
    assert first.scenario.digest == again.scenario.digest
    assert first.scenario.digest != other.scenario.digest
    cells = interior(first.scenario.map.occupancy, 1)
    walls = cells.mean(axis=0 if cells.any(axis=0).mean() < 0.5 else 1)
    assert set(np.unique(walls > 0.8)) == {False, True}
    assert gymnasium.make("MapBench-v0", family="u_traps").reset(seed=0)[0]


def test_a_finer_resolution_keeps_sizes_in_metres():
    config = EnvConfig(family={"name": "doors", "options": {"gap": [0.8, 0.8]}}, resolution=0.1)
    env = MapBenchEnv(config)
    env.reset(seed=0)
    assert env.scenario.map.resolution == 0.1
    assert narrowest_passage(env.scenario.map, *ENDS) == pytest.approx(0.8)


def test_families_are_read_from_names_and_mappings_and_dumped_as_data():
    doors = FamilySpec(name="doors")
    narrow = {"name": "doors", "options": {"gap": [0.55, 0.6]}}
    assert EnvConfig().family == EnvConfig(family=None).family == ()
    assert EnvConfig(family="doors").family == EnvConfig(family=["doors"]).family == (doors,)
    config = EnvConfig(family=[narrow, "pillars"])
    assert config.family == (FamilySpec.from_mapping(narrow, "family"), FamilySpec(name="pillars"))
    assert EnvConfig.from_mapping(config.model_dump(mode="json"), "config") == config
    assert config.family[0].make().gap == (0.55, 0.6)
    env = MapBenchEnv(family="sparse")
    env.reset(seed=0)
    on_map = EnvConfig(family="sparse").with_maps([env.scenario])
    assert on_map.family == ()
    assert on_map.load_scenarios()[0].digest == env.scenario.digest


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"family": "dors"}, r"family: unknown family 'dors'; did you mean 'doors'\?"),
        ({"family": 3}, "family: expected the name of a family, or a mapping"),
        ({"family": {"name": "doors", "ranges": {}}}, "ranges"),
        ({"family": {"name": "doors", "options": {"gaps": [1, 2]}}}, "doors: unknown key 'gaps'; did you mean 'gap'"),
        ({"family": {"name": "doors", "options": {"gap": [0.9, 0.5]}}}, r"doors: gap: expected \(smallest, largest\)"),
        ({"family": {"name": "pillars", "options": {"side": [0, 0.5]}}}, "pillars: side.0: expected greater than 0"),
        ({"family": "doors", "maps": ("....", "....")}, "family: expected none beside maps"),
    ],
)
def test_bad_families_are_one_line(options, message):
    with pytest.raises(ConfigError, match=message) as error:
        EnvConfig(**options)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("family", "shapes", "message"),
    [
        ({"name": "doors", "options": {"gap": [0.3, 0.45]}}, {}, "doors: expected maps that turtlebot3_waffle can"),
        ({"name": "pillars", "options": {"pitch": [0.8, 0.8], "side": [0.4, 0.4]}}, {}, "got none in 200 samples"),
        ("doors", {"size": 47, "task_distance": 10}, r"size: expected at least \d+ cells for walls across the way"),
        ("corridors", {"size": 23, "cleared_distance": 0, "task_distance": 3}, "corridors: expected maps"),
    ],
)
def test_families_without_a_way_are_one_line(family, shapes, message):
    env = MapBenchEnv(family=family, shapes=shapes)
    with pytest.raises(ConfigError, match=message) as error:
        env.reset(seed=0)
    assert "\n" not in str(error.value)


def test_random_shapes_as_a_family_are_the_thesis_maps_that_can_be_driven():
    one = draw_from(np.random.default_rng(0), [FamilySpec(name="shapes")], THESIS, WAFFLE)
    assert np.array_equal(one.cells, sample_map(np.random.default_rng(one.genes.layout), THESIS))
    genes = [make_family(name).genes for name in FAMILIES]
    assert len({*genes} - {MotifGenes}) == len(genes) - genes.count(MotifGenes)


class Failing(Doors):
    """A third party's family with an error."""

    def draw_genes(self, rng):
        return {}["gap"]


class WithoutGenes(Doors):
    """A third party's family whose genes are no settings."""

    def draw_genes(self, rng):
        return {"gap": 1.0}


class Small(Doors):
    """A third party's family with maps of another size."""

    def build(self, genes, shapes):
        return np.zeros((3, 3), dtype=bool)


class FailingMotif(Motif):
    """A third party's motif with an error."""

    def walls(self, around, genes):
        return genes["nothing"]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Failing", r"family '\S+:Failing': KeyError: 'gap', test_families.py line \d+"),
        ("WithoutGenes", r"family '\S+': expected genes of a subclass of Settings, got \{'gap': 1.0\}"),
        ("Small", r"family '\S+:Small': expected cells as bool \(150, 150\), got bool \(3, 3\)"),
        ("FailingMotif", r"family '\S+:FailingMotif': KeyError: 'nothing', test_families.py line \d+"),
    ],
)
def test_errors_of_a_third_party_name_the_family_and_the_line(name, message):
    rng, spec = np.random.default_rng(0), FamilySpec(name=f"{__name__}:{name}")
    with pytest.raises(PluginError, match=message):
        draw_from(rng, [spec], THESIS, WAFFLE)
    with pytest.raises(PluginError, match=message):
        draw_obstacle(rng, THESIS, [spec], (140, 140))


def test_errors_of_a_motif_in_a_sequence_name_the_motif():
    motif = f"{__name__}:FailingMotif"
    spec = FamilySpec(name="sequences", options={"motifs": {motif: {}}})
    with pytest.raises(PluginError, match=rf"motif '{motif}': KeyError: 'nothing'"):
        draw_from(np.random.default_rng(0), [spec], THESIS, WAFFLE)
