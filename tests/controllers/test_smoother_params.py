"""The smoother server in parameter files: read, checked, written, converted and summarised."""

from __future__ import annotations

import pytest
import yaml

from controllers.nav2_params import NavigationParams, parse_nav2_params, summarise, write_nav2_params
from controllers.nav2_params.file.document import Document
from controllers.nav2_params.migration import migrate_file
from controllers.nav2_params.presets import load_preset
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES
from tests.controllers.trees import FOLLOW, PLAN, xml_of

SIMPLE, GOLAY = "nav2_smoother::SimpleSmoother", "nav2_smoother::SavitzkyGolaySmoother"
CERES = "nav2_constrained_smoother/ConstrainedSmoother"


def node(**params):
    return {"ros__parameters": params}


def smooth(smoother_id: str = "") -> str:
    named = f'smoother_id="{smoother_id}"' if smoother_id else ""
    return f'<SmoothPath unsmoothed_path="{{path}}" smoothed_path="{{path}}" {named}/>'


def tree_of(*nodes: str) -> str:
    return xml_of(f"<Sequence>{PLAN}{''.join(nodes)}{FOLLOW}</Sequence>")


def read(folder, server, *nodes: str, release="jazzy"):
    """Read a file with a smoother server and a tree with these nodes; Nav2's default tree without nodes."""
    document = {"smoother_server": node(**server), "bt_navigator": node()}
    if nodes:
        (folder / "mine.xml").write_text(tree_of(*nodes))
        document["bt_navigator"] = node(default_nav_to_pose_bt_xml="mine.xml")
    return parse_nav2_params(Document(document, folder=folder), load_preset(release), release=release)


def found(parsed) -> dict[str, tuple[str, str]]:
    return {finding.name: (finding.kind, finding.why) for finding in parsed.findings}


def test_the_smoothers_of_a_file_are_read_if_its_tree_smooths(tmp_path):
    server = {
        "smoother_plugins": ["simple_smoother", "golay"],
        "simple_smoother": {"plugin": SIMPLE, "tolerance": 1e-6, "max_its": 300, "refinement_num": 3},
        "golay": {"plugin": GOLAY, "do_refinement": False},
    }
    parsed = read(tmp_path, server, smooth("simple_smoother"), smooth("golay"))
    simple, golay = parsed.navigation.smoothers.values()
    assert (simple.kind, simple.params["max_its"], simple.params["refinement_num"]) == ("simple", 300, 3)
    assert (golay.kind, golay.params["do_refinement"]) == ("savitzky_golay", False)
    assert parsed.navigation.smoothers == parsed.navigation.used_smoothers
    assert any("smooths: the simple smoother, the Savitzky-Golay smoother" in line for line in summarise(parsed))
    assert not any(name.startswith("smoother_server") for name in found(parsed))


def test_a_smoother_for_which_no_node_asks_is_no_part_of_the_run(tmp_path):
    server = {"smoother_plugins": ["mine"], "mine": {"plugin": CERES}}
    parsed = read(tmp_path, server)
    assert parsed.navigation.smoothers == {}
    assert found(parsed)["smoother_server"] == ("unused", "no node of the tree smooths a path")
    server = {"smoother_plugins": ["a", "b"], "a": {"plugin": SIMPLE}, "b": {"plugin": CERES}}
    parsed = read(tmp_path, server, smooth("a"))
    assert list(parsed.navigation.smoothers) == ["a"]
    assert found(parsed)["smoother_server.b"][0] == "unused"


def test_a_server_without_a_section_or_a_list_has_the_simple_smoother(tmp_path):
    parsed = read(tmp_path, {"simple_smoother": {"w_smooth": 0.25}}, smooth())
    assert parsed.navigation.used_smoothers["simple_smoother"].params["w_smooth"] == 0.25
    (tmp_path / "mine.xml").write_text(tree_of(smooth()))
    document = Document({"bt_navigator": node(default_nav_to_pose_bt_xml="mine.xml")}, folder=tmp_path)
    bare = parse_nav2_params(document, load_preset("jazzy"), release="jazzy")
    assert list(bare.navigation.used_smoothers) == ["simple_smoother"]
    assert "smoother_server" not in bare.defaulted


@pytest.mark.parametrize(
    ("server", "nodes", "why"),
    [
        (
            {"smoother_plugins": ["SmoothPath"], "SmoothPath": {"plugin": CERES}},
            [smooth()],
            r"smoother_server\.SmoothPath\.plugin: smoother '.*ConstrainedSmoother' is not built here",
        ),
        ({"smoother_plugins": ["a"], "a": {}}, [smooth()], r"a\.plugin: expected the class of this smoother, got none"),
        (
            {"smoother_plugins": ["a", "b"], "a": {"plugin": SIMPLE}, "b": {"plugin": GOLAY}},
            [smooth()],
            "a SmoothPath of the tree .* names none of a, b, so Nav2 smooths no path; give it a smoother_id",
        ),
        ({}, [smooth("b")], r"smoother_plugins: expected 'b' among them, .* got \['simple_smoother'\]"),
        ({"simple_smoother": {"w_data": -1.0}}, [smooth()], r"smoother_server\.simple_smoother\.w_data: expected"),
    ],
)
def test_what_the_tree_cannot_do_without_is_refused(tmp_path, server, nodes, why):
    with pytest.raises(ConfigError, match=why):
        read(tmp_path, server, *nodes)


def test_keys_without_effect_are_told(tmp_path):
    server = {
        "costmap_topic": "local_costmap/costmap_raw",
        "footprint_topic": "global_costmap/published_footprint",
        "simple_smoother": {
            "plugin": SIMPLE,
            "max_its": 1000.0,
            "w_smoth": 0.3,
            "enforce_path_inversion": False,
            "window_size": 7,
        },
    }
    kinds = found(read(tmp_path, server, smooth()))
    server = "smoother_server"
    assert kinds[f"{server}.costmap_topic"][0] == "left_out"
    assert kinds[f"{server}.footprint_topic"] == ("ros_only", "")
    assert kinds[f"{server}.simple_smoother.max_its"][0] == "mistyped"
    assert kinds[f"{server}.simple_smoother.w_smoth"] == ("unknown", "did you mean 'w_smooth'?")
    assert kinds[f"{server}.simple_smoother.enforce_path_inversion"][0] == "other_release"
    assert kinds[f"{server}.simple_smoother.window_size"][1] == "a parameter of the Savitzky-Golay smoother"


@pytest.mark.parametrize("release", RELEASES)
def test_written_smoothers_are_read_back(tmp_path, release):
    preset = load_preset("thesis" if release == "humble" else release)
    bt = preset.bt.replace(xml=tree_of(smooth("a"), smooth("b")))
    smoothers = {"a": {"params": {"max_its": 77}}, "b": {"kind": "savitzky_golay"}}
    own = preset.replace(bt=bt, smoothers=smoothers)
    written = write_nav2_params(own)
    group = written["smoother_server"]["ros__parameters"]
    assert (group["smoother_plugins"], group["a"]["plugin"], group["a"]["max_its"]) == (["a", "b"], SIMPLE, 77)
    (tmp_path / "mine.xml").write_text(bt.xml)
    written["bt_navigator"]["ros__parameters"]["default_nav_to_pose_bt_xml"] = "mine.xml"
    parsed = parse_nav2_params(Document(yaml.safe_load(yaml.safe_dump(written)), folder=tmp_path), release=release)
    assert parsed.navigation.smoothers == own.smoothers
    assert "smoother_server" not in write_nav2_params(preset.replace(smoothers=smoothers))
    with pytest.raises(ConfigError, match=r"smoothers\.a\.kind: expected one that ROS has"):
        write_nav2_params(own.replace(smoothers={"a": {"kind": "gym_mapbench.smoothers:SimpleSmoother"}}))


def codes_in(release: str, *codes: str) -> dict:
    """What the navigator's section says of the error codes of a tree, one of them in a subtree of its own."""
    inside = smooth().replace("/>", ' error_code_id="{inside_error_code}"/>')
    smooths = (smooth().replace("/>", f' error_code_id="{{{code}}}"/>') for code in codes)
    part = f'<BehaviorTree ID="Part"><Sequence>{PLAN}{inside}</Sequence></BehaviorTree>'
    tree = tree_of(*smooths, '<SubTree ID="Part" goal="{goal}" path="{path}"/>').replace("</root>", f"{part}</root>")
    navigation = load_preset(release)
    written = write_nav2_params(navigation.replace(bt=navigation.bt.replace(xml=tree)))
    return {key: value for key, value in written["bt_navigator"]["ros__parameters"].items() if "error" in key}


def test_the_error_codes_of_an_own_tree_are_written():
    codes = "smoother_error_code", "mine"
    assert codes_in("jazzy", *codes) == {"error_code_names": ["smoother_error_code", "mine"]}
    assert codes_in("lyrical", *codes) == {"error_code_name_prefixes": ["smoother"]}
    assert codes_in("jazzy") == {"error_code_names": ["compute_path_error_code", "follow_path_error_code"]}
    assert codes_in("lyrical", "mine") == {}


def convert(tmp_path, source, target, **smoothers):
    path = tmp_path / "file.yaml"
    server = node(smoother_plugins=list(smoothers), **smoothers)
    path.write_text(yaml.safe_dump({"smoother_server": server}))
    migration = migrate_file(path, target, source)
    return yaml.safe_load(migration.text)["smoother_server"]["ros__parameters"], migration


def test_humbles_four_refinements_are_written_out(tmp_path):
    simple, golay = {"plugin": SIMPLE, "max_its": 500}, {"plugin": GOLAY}
    server, migration = convert(tmp_path, "humble", "jazzy", a=simple, b=golay)
    assert server["a"] == {**simple, "refinement_num": 4}
    assert server["b"] == golay
    assert "smoother_server.a.refinement_num: written out as 4, as often as Humble refines" in migration.done


def test_a_parameter_that_humble_ignores_counts_in_jazzy(tmp_path):
    server, migration = convert(tmp_path, "humble", "lyrical", simple_smoother={"refinement_num": 1})
    assert server["simple_smoother"] == {"refinement_num": 1}
    assert any("counts in Lyrical, and not in Humble" in line for line in migration.done)


def test_parameters_that_a_release_lacks_are_taken_out_and_named(tmp_path):
    simple = {"plugin": SIMPLE, "refinement_num": 5, "enforce_path_inversion": True}
    golay = {"plugin": GOLAY, "refinement_num": 5, "window_size": 9, "poly_order": 2}
    server, migration = convert(tmp_path, "lyrical", "humble", a=simple, b=golay, c={"plugin": CERES, "w_cost": 1.0})
    assert server["a"] == {"plugin": SIMPLE}
    assert server["b"] == {"plugin": GOLAY, "refinement_num": 5}
    assert server["c"] == {"plugin": CERES, "w_cost": 1.0}
    assert len(migration.lost) == 4
    assert any(line.endswith("a.refinement_num: taken out: a path is refined 4 times") for line in migration.lost)
    server, migration = convert(tmp_path, "lyrical", "jazzy", a=simple, b=golay)
    assert server["a"] == {"plugin": SIMPLE, "refinement_num": 5}
    assert len(migration.lost) == 3


def test_smoothers_without_a_tree_that_smooths_are_kept_and_not_used():
    params = NavigationParams(smoothers={"a": {}})
    assert (list(params.smoothers), params.used_smoothers) == (["a"], {})
    assert params.model_dump(mode="json")["smoothers"]["a"]["kind"] == "simple"
