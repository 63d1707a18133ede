"""Costmap filters in parameter files: read with their servers and masks, left out with the reason, refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from controllers.nav2_params import NavigationParams, mask_files, parse_nav2_params, read_nav2_params, write_nav2_params
from controllers.nav2_params.migration import migrate_file
from controllers.nav2_params.summary import describe_filters, summarise
from gym_mapbench.costmap import CostmapParams, FilterMask, InflationLayer, KeepoutFilter, SpeedFilter
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio.netpbm import encode_pgm
from gym_mapbench.releases import RELEASES

PLUGIN = {"humble": "nav2_navfn_planner/NavfnPlanner"}
MASK_YAML = (
    "image: {image}\nmode: scale\nresolution: 0.5\norigin: [-1.0, 2.0, 0.0]\nnegate: 1\noccupied_thresh: 1.0\n"
    "free_thresh: 0.0\n"
)
VALUES = np.array([[0, 100, 40], [0, 0, 20]], np.int8)
MASK = FilterMask.from_values(VALUES, 0.5, (-1.0, 2.0))


@pytest.fixture
def folder(tmp_path):
    """A folder with the mask: bright cells have high values."""
    for name in ("keepout", "speed"):
        (tmp_path / f"{name}.yaml").write_text(MASK_YAML.format(image=f"{name}.pgm"))
        (tmp_path / f"{name}.pgm").write_bytes(encode_pgm(np.rint(VALUES[::-1] * 2.55).astype(np.uint8)))
    return tmp_path


def keepout(**changes):
    return {"plugin": "nav2_costmap_2d::KeepoutFilter", "filter_info_topic": "/keepout_info"} | changes


def speed(**changes):
    return {"plugin": "nav2_costmap_2d::SpeedFilter", "filter_info_topic": "speed_info"} | changes


def node(**values):
    return {"ros__parameters": values}


def servers(name, **changes):
    info = {"filter_info_topic": f"{name}_info", "mask_topic": f"/{name}_mask"} | changes
    return {
        f"{name}_costmap_filter_info_server": node(**info),
        f"{name}_filter_mask_server": node(topic_name=f"{name}_mask", yaml_filename=f"{name}.yaml", frame_id="map"),
    }


KEEPOUT_SERVERS = servers("keepout", type=0, base=0.0, multiplier=1.0)
SPEED_SERVERS = servers("speed", type=1, base=100.0, multiplier=-1.0)


def document(release="jazzy", more=(), controller_server=None, **filters):
    """A file whose global costmap has these filters."""
    costmap = {"filters": list(filters), **filters}
    planner = {
        "planner_plugins": ["GridBased"],
        "GridBased": {"plugin": PLUGIN.get(release, "nav2_navfn_planner::NavfnPlanner")},
    }
    nodes = {
        "planner_server": node(**planner),
        "global_costmap": {"global_costmap": node(**costmap)},
        **KEEPOUT_SERVERS,
        **SPEED_SERVERS,
        **dict(more),
    }
    return {name: value for name, value in nodes.items() if value is not None}


def read(folder, release="jazzy", **changes):
    path = folder / "nav2_params.yaml"
    path.write_text(yaml.safe_dump(document(release, **changes)))
    return read_nav2_params(path, release=release)


def findings(given):
    return {finding.name.rpartition(".")[2]: (finding.kind, finding.why) for finding in given.findings}


@pytest.mark.parametrize("release", RELEASES)
def test_both_filters_of_a_file(folder, release):
    given = read(folder, release, zones=keepout(), slow=speed(transform_tolerance=0.2))
    costmap = given.navigation.global_costmap
    assert costmap.keepout_filters == {"zones": KeepoutFilter(mask=MASK)}
    expected = SpeedFilter(mask=MASK, base=100.0, multiplier=-1.0, percentage=True)
    assert costmap.speed_filters == {"slow": expected}
    assert not given.navigation.local_costmap.keepout_filters
    assert not given.named("left_out")
    assert not any("server" in name.split(".")[0] and "." not in name for name in given.named("ros_only"))


@pytest.mark.parametrize("release", RELEASES)
def test_the_override_since_jazzy(folder, release):
    given = read(folder, release, zones=keepout(override_lethal_cost=True, lethal_override_cost=254))
    zones = given.navigation.global_costmap.keepout_filters["zones"]
    if release == "humble":
        assert not zones.override_lethal_cost
        assert findings(given)["override_lethal_cost"][0] == "other_release"
    else:
        assert (zones.override_lethal_cost, zones.lethal_override_cost) == (True, 252)
        assert findings(given)["lethal_override_cost"] == ("replaced", "taken as 252: Nav2 does likewise")


def test_both_costmaps_may_listen_to_the_same_servers(folder):
    local = {"local_costmap": {"local_costmap": node(filters=["zones"], zones=keepout())}}
    given = read(folder, more=local, zones=keepout())
    assert given.navigation.local_costmap.keepout_filters == given.navigation.global_costmap.keepout_filters
    assert given.named("ros_only").count("keepout_filter_mask_server.frame_id") == 1


INFLATION = {"plugin": "nav2_costmap_2d::InflationLayer", "inflation_radius": 0.9, "cost_scaling_factor": 2.0}


@pytest.mark.parametrize("release", RELEASES)
def test_an_inflation_layer_behind_the_filters(folder, release):
    given = read(folder, release, zones=keepout(), again=INFLATION)
    costmap = given.navigation.global_costmap
    assert costmap.inflation_filters == {"again": InflationLayer(inflation_radius=0.9, cost_scaling_factor=2.0)}
    assert not given.named("left_out")
    assert "again (global_costmap) inflates the zones by 0.9 m" in describe_filters(given.navigation)
    written = write_nav2_params(given.navigation)["global_costmap"]["global_costmap"]["ros__parameters"]
    assert written["filters"] == ["zones", "again"]
    assert written["again"].items() >= INFLATION.items()


def test_an_inflation_layer_may_be_a_layer_and_behind_the_filters_at_once(folder):
    """Its section counts for both; the layer had the defaults of Nav2's code, not those of the file."""
    path = folder / "nav2_params.yaml"
    costmap = {"plugins": ["static_layer", "inflation_layer"], "filters": ["zones", "inflation_layer"]}
    costmap |= {"static_layer": LAYERS["static_layer"], "inflation_layer": INFLATION | {"odd": 1}, "zones": keepout()}
    path.write_text(yaml.safe_dump(document(more={"global_costmap": {"global_costmap": node(**costmap)}})))
    given = read_nav2_params(path, release="jazzy")
    expected = InflationLayer(inflation_radius=0.9, cost_scaling_factor=2.0)
    assert given.navigation.global_costmap.inflation_layer == expected
    assert given.navigation.global_costmap.inflation_filters == {"inflation_layer": expected}
    assert given.named("unknown") == ("global_costmap.global_costmap.inflation_layer.odd",)
    written = write_nav2_params(given.navigation)["global_costmap"]["global_costmap"]["ros__parameters"]
    assert (written["plugins"], written["filters"]) == (costmap["plugins"], costmap["filters"])
    assert parse_nav2_params({"global_costmap": {"global_costmap": node(**written)}}, None, "jazzy")


def test_an_inflation_layer_before_a_keepout_filter_is_listed(folder):
    given = read(folder, again=INFLATION, zones=keepout())
    assert not given.navigation.global_costmap.inflation_filters
    assert findings(given)["again"] == (
        "left_out",
        "an inflation layer has an effect here only behind all keepout filters",
    )


LAYERS = {
    "static_layer": {"plugin": "nav2_costmap_2d::StaticLayer"},
    "inflate": {"plugin": "nav2_costmap_2d::InflationLayer"},
}


def among_layers(*names, **groups):
    """The global costmap of a file that lists layers and filters in ``plugins``."""
    values = {"plugins": ["static_layer", *names, "inflate"], **LAYERS, **groups}
    return {"global_costmap": {"global_costmap": node(**values)}}


@pytest.mark.parametrize("release", RELEASES)
def test_filters_among_the_layers_work_there_and_are_written_there(folder, release):
    filters = {"zones": keepout(), "slow": speed()}
    read_back = read(folder, release, more=among_layers(*filters, **filters))
    costmap = read_back.navigation.global_costmap
    assert costmap.plugins == ("static_layer", "zones", "slow", "inflation_layer")
    assert (costmap.keepout_filters["zones"].mask, list(costmap.speed_filters)) == (MASK, ["slow"])
    assert not read_back.named("left_out")
    document = write_nav2_params(read_back.navigation)
    written = document["global_costmap"]["global_costmap"]["ros__parameters"]
    assert written["plugins"] == list(costmap.plugins)
    assert written["zones"]["plugin"] == keepout()["plugin"]
    assert "filters" not in written, "ROS takes no empty list"
    for name, content in mask_files(read_back.navigation).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    (folder / "again.yaml").write_text(yaml.safe_dump(document))
    assert read_nav2_params(folder / "again.yaml", release=release).navigation.global_costmap == costmap


def test_filters_among_the_layers_without_effect_are_listed_with_the_reason(folder):
    off, binary = keepout(enabled=False), {"plugin": "nav2_costmap_2d::BinaryFilter"}
    given = read(
        folder, more=among_layers("off", "switch", "lost", off=off, switch=binary, lost=speed(filter_info_topic="x"))
    )
    assert given.navigation.global_costmap.plugins == ("static_layer", "inflation_layer")
    found = findings(given)
    assert found["off"] == ("unused", "it is not enabled")
    assert found["switch"] == ("ros_only", "nobody here listens to its switch")
    assert found["lost"] == ("left_out", "the file has no node whose filter_info_topic is x")


def test_servers_may_have_any_name(folder):
    """In Nav2 a mask comes from a map server of any name."""
    more = {
        "keepout_filter_mask_server": None,
        "keepout_costmap_filter_info_server": None,
        "zones_info": KEEPOUT_SERVERS["keepout_costmap_filter_info_server"],
        "zones_map": KEEPOUT_SERVERS["keepout_filter_mask_server"],
    }
    given = read(folder, more=more, zones=keepout())
    assert given.navigation.global_costmap.keepout_filters["zones"].mask == MASK
    assert not given.named("left_out")


def test_absolute_limits(folder):
    more = servers("speed", type=2, base=0.0, multiplier=0.01)
    slow = read(folder, more=more, slow=speed()).navigation.global_costmap.speed_filters["slow"]
    assert not slow.percentage
    assert slow.limit_of(40) == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("changes", "kind", "why"),
    [
        ({"zones": keepout(enabled=False)}, "unused", "it is not enabled"),
        (
            {"zones": keepout(enabled="KEEPOUT_ZONE_ENABLED")},
            "left_out",
            "the launch file enables it; --define KEEPOUT_ZONE_ENABLED=true",
        ),
        (
            {"zones": keepout(filter_info_topic="elsewhere")},
            "left_out",
            "the file has no node whose filter_info_topic is elsewhere",
        ),
        (
            {"zones": keepout(), "more": {"keepout_filter_mask_server": None}},
            "left_out",
            "the file has no node whose topic_name is /keepout_mask",
        ),
        (
            {"zones": keepout(), "more": {"keepout_filter_mask_server": node(topic_name="keepout_mask")}},
            "left_out",
            "keepout_filter_mask_server has no yaml_filename",
        ),
        (
            {"zones": speed(speed_limit_topic="/limits")},
            "left_out",
            "it publishes on /limits, but the controller server listens to speed_limit",
        ),
        ({"zones": {"plugin": "nav2_costmap_2d::BinaryFilter"}}, "ros_only", "nobody here listens to its switch"),
        ({"zones": {"plugin": "mine::Filter"}}, "left_out", "mine::Filter: this filter is not built"),
    ],
)
def test_filters_without_effect_are_listed_with_the_reason(folder, changes, kind, why):
    given = read(folder, **changes)
    assert findings(given)["zones"] == (kind, why)
    assert not given.navigation.global_costmap.keepout_filters
    assert not given.navigation.global_costmap.speed_filters


def test_a_define_enables_a_filter(folder):
    path = folder / "nav2_params.yaml"
    path.write_text(yaml.safe_dump(document(zones=keepout(enabled="KEEPOUT_ZONE_ENABLED"))).replace("'", ""))
    given = read_nav2_params(path, defines={"KEEPOUT_ZONE_ENABLED": "true"})
    assert "zones" in given.navigation.global_costmap.keepout_filters


NO_TOPIC = {"plugin": "nav2_costmap_2d::KeepoutFilter"}
NO_FILE = {
    "a_filter_mask_server": node(topic_name="keepout_mask", yaml_filename="no.yaml"),
    "keepout_filter_mask_server": None,
}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"zones": {"filter_info_topic": "a"}}, r"zones\.plugin: expected the class of this filter, got none"),
        ({"zones": NO_TOPIC}, r"zones\.filter_info_topic: expected the topic of an info server, got none"),
        ({"zones": keepout(enabled="yes")}, r"zones\.enabled: expected true or false, got 'yes'"),
        ({"zones": keepout(lethal_override_cost=-1)}, r"zones\.lethal_override_cost: expected .*0, got -1"),
        ({"zones": speed(), "more": servers("speed", type=0)}, r"\.type: expected 1 \(per cent\) or 2 \(m/s\), got 0"),
        ({"zones": speed(), "more": servers("speed", type="1")}, r"\.type: expected .*, got '1'"),
        ({"zones": speed(), "more": servers("speed", base="a")}, r"\.base: expected .*, got 'a'"),
        ({"zones": speed(), "more": servers("speed", multiplier=[1])}, r"\.multiplier: expected .*, got \[1\]"),
        ({"zones": keepout(), "more": NO_FILE}, r"a_filter_mask_server\.yaml_filename: .*no\.yaml: "),
    ],
)
def test_refused_in_one_line(folder, changes, message):
    with pytest.raises(ConfigError, match=message) as error:
        read(folder, **changes)
    assert "\n" not in str(error.value)
    assert str(folder / "nav2_params.yaml") in str(error.value)


def test_a_mask_that_is_no_map(folder):
    (folder / "keepout.yaml").write_text("image: keepout.pgm\n")
    with pytest.raises(ConfigError, match=r"yaml_filename: .*keepout\.yaml: not a map_server file"):
        read(folder, zones=keepout())


def test_another_base_of_a_keepout_filter_is_not_read(folder):
    more = servers("keepout", type=0, base=1.0, multiplier=2.0)
    given = read(folder, more=more, zones=keepout())
    assert findings(given)["base"] == findings(given)["multiplier"] == ("unused", "keepout filters do not read it")
    assert given.navigation.global_costmap.keepout_filters["zones"].mask == MASK


def test_a_file_without_filters_is_as_before():
    plain = {"planner_server": document()["planner_server"], "global_costmap": {"global_costmap": node(width=4)}}
    assert parse_nav2_params(plain).navigation == parse_nav2_params({**plain, **KEEPOUT_SERVERS}).navigation


@pytest.mark.parametrize("release", RELEASES)
def test_written_files_read_back_the_same(folder, tmp_path, release):
    options = {} if release == "humble" else {"override_lethal_cost": True, "lethal_override_cost": 100}
    navigation = read(folder, release, zones=keepout(**options), slow=speed()).navigation
    local = navigation.local_costmap.replace(keepout_filters=navigation.global_costmap.keepout_filters)
    navigation = navigation.replace(local_costmap=local)
    out = tmp_path / "written"
    for name, content in mask_files(navigation).items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    (out / "nav2_params.yaml").write_text(yaml.safe_dump(write_nav2_params(navigation)))
    again = read_nav2_params(out / "nav2_params.yaml", release=release).navigation
    assert again.global_costmap == navigation.global_costmap
    assert again.local_costmap == navigation.local_costmap


def test_nodes_and_topics_have_names_that_ros_takes():
    costmap = CostmapParams(keepout_filters={"keep-out": KeepoutFilter(mask=MASK)})
    written = write_nav2_params(NavigationParams(local_costmap=costmap))
    server = "local_costmap_keep_out_filter_info_server"
    topic = written[server]["ros__parameters"]["filter_info_topic"]
    group = written["local_costmap"]["local_costmap"]["ros__parameters"]["keep-out"]
    assert group["filter_info_topic"] == topic == "local_costmap_keep_out_info"


def test_filters_that_ros_would_call_the_same_keep_a_mask_each():
    masks = [FilterMask.from_values(np.full((2, 2), value, np.int8), 0.5) for value in (0, 50, 100)]
    names = ("keep-out", "keep_out", "keep_out_2")
    filters = {name: KeepoutFilter(mask=mask) for name, mask in zip(names, masks, strict=True)}
    navigation = NavigationParams(local_costmap=CostmapParams(keepout_filters=filters))
    written, files = write_nav2_params(navigation), mask_files(navigation)
    groups = written["local_costmap"]["local_costmap"]["ros__parameters"]
    servers_of = {group["filter_info_topic"].removesuffix("_info") for group in (groups[name] for name in names)}
    assert servers_of == {"local_costmap_keep_out", "local_costmap_keep_out_2", "local_costmap_keep_out_2_2"}
    assert {f"{name}_filter_mask_server" for name in servers_of} <= set(written)
    assert {Path(name).stem for name in files} == servers_of
    assert len({content for name, content in files.items() if name.endswith(".pgm")}) == 3


def test_saved_settings_hold_the_masks(folder):
    navigation = read(folder, zones=keepout(), slow=speed()).navigation
    assert NavigationParams(**navigation.model_dump(mode="json")) == navigation


def test_the_summary_says_what_filters_do(folder):
    lines = summarise(read(folder, zones=keepout(override_lethal_cost=True), slow=speed()))
    assert "costmap filter: zones (global_costmap) closes 0.2 m^2 and raises the cost of 0.5 m^2; " in "\n".join(lines)
    assert "a robot inside sees cost 252" in "\n".join(lines)
    limits = "costmap filter: slow (global_costmap) limits the speed to 60 to 80 % on 0.5 m^2"
    assert limits in lines, "the limit 0 % of value 100 is none"


def test_a_speed_filter_without_limits_says_so():
    unlimited = SpeedFilter(mask=FilterMask.from_values(np.zeros((2, 2), np.int8), 0.5))
    costmap = CostmapParams(speed_filters={"slow": unlimited})
    (line,) = describe_filters(NavigationParams(global_costmap=costmap))
    assert line == "slow (global_costmap) limits no speed, as no value of its mask gives a limit"


def test_humble_loses_the_override_and_keeps_the_filters(folder):
    read(folder, zones=keepout(override_lethal_cost=True, lethal_override_cost=100), slow=speed())
    migration = migrate_file(folder / "nav2_params.yaml", "humble", "jazzy")
    lost = [line for line in migration.lost if "lethal" in line]
    assert len(lost) == 2
    assert all("Humble has no such parameter" in line for line in lost)
    (folder / "humble.yaml").write_text(migration.text)
    costmap = read_nav2_params(folder / "humble.yaml", release="humble").navigation.global_costmap
    assert (list(costmap.keepout_filters), list(costmap.speed_filters)) == (["zones"], ["slow"])
