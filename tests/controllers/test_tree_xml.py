from __future__ import annotations

import pytest

from controllers.tree_xml.needs import plugin_names
from controllers.tree_xml.reading import read_tree
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES
from tests.controllers.trees import FOLLOW, PLAN, default_xml, xml_of

DRIVE = f"<Sequence>{PLAN}{FOLLOW}</Sequence>"


def names(xml: str, release: str = "humble") -> list[str]:
    return [node.name for node in read_tree(xml, release).walk()]


@pytest.mark.parametrize("release", RELEASES)
def test_the_exported_default_tree_is_read(release):
    read = read_tree(default_xml(release, replanning_frequency=2.5), release)
    rates = [node.ports["hz"] for node in read.walk() if node.name == "RateController"]
    assert (read.name, rates) == ("RecoveryNode", [2.5])
    assert plugin_names(read) == {"planner_id": "GridBased", "controller_id": "FollowPath"}


def test_ports_that_are_not_given_have_nav2s_defaults():
    tree = read_tree(xml_of(f"<Sequence><BackUp/><Wait/>{PLAN}{FOLLOW}</Sequence>"), "humble")
    backup, wait = tree.children[:2]
    assert (backup.ports["backup_dist"], backup.ports["backup_speed"], wait.ports["wait_duration"]) == (0.15, 0.025, 1)


@pytest.mark.parametrize(
    ("release", "given", "found"),
    [
        ("humble", 'success_threshold="-1"', {"success_threshold": -1, "failure_threshold": 1}),
        ("jazzy", "", {"success_count": -1, "failure_count": 1}),
        ("lyrical", 'failure_count="-2"', {"success_count": -1, "failure_count": -2}),
    ],
)
def test_a_parallel_has_the_ports_of_its_release(release, given, found):
    ports = read_tree(xml_of(f"<Parallel {given}>{DRIVE}<Wait/></Parallel>"), release).ports
    assert {key: ports[key] for key in found} == found


def test_a_retry_without_end_and_an_infinite_distance_are_read():
    cut = '<TruncatePathLocal output_path="{part}" max_robot_pose_search_dist="inf"/>'
    retry = f'<RetryUntilSuccesful num_attempts="-1"><Sequence>{PLAN}{cut}{FOLLOW}</Sequence></RetryUntilSuccesful>'
    read = read_tree(xml_of(retry), "humble")
    assert read.ports["num_attempts"] == -1
    assert read.children[0].children[1].ports["max_robot_pose_search_dist"] == float("inf")


def subtrees(depth: int) -> str:
    """Return a file in which each tree has the next one twice."""
    trees = [
        f'<BehaviorTree ID="{i}"><Sequence>{f"""<SubTree ID="{i + 1}"/>""" * 2}</Sequence></BehaviorTree>'
        for i in range(depth)
    ]
    return f'<root main_tree_to_execute="0">{"".join(trees)}<BehaviorTree ID="{depth}">{DRIVE}</BehaviorTree></root>'


def test_compact_elements_are_the_same_nodes():
    compact = '<Control ID="Sequence"><Action ID="Wait" wait_duration="2"/>' + PLAN + FOLLOW + "</Control>"
    assert names(xml_of(compact)) == ["Sequence", "Wait", "ComputePathToPose", "FollowPath"]


def test_a_subtree_is_put_in_place_with_the_variables_it_is_given():
    inside = FOLLOW.replace("{path}", "{route}")
    for given in ('route="{path}"', 'route="path"', '_autoremap="true"'):
        route = "{route}" if given.startswith("_") else "{path}"
        main = f'<Sequence>{PLAN.replace("{path}", route)}<SubTree ID="Drive" {given}/></Sequence>'
        tree = f'<BehaviorTree ID="Main">{main}</BehaviorTree><BehaviorTree ID="Drive">{inside}</BehaviorTree>'
        read = read_tree(f'<root main_tree_to_execute="Main">{tree}</root>', "humble")
        plan, follow = read.children
        assert plan.ports["path"] == follow.ports["path"] == route.strip("{}")


SET = '<SetBlackboard value="{}" output_key="{}"/>'


@pytest.mark.parametrize("release", ["jazzy", "lyrical"])
def test_a_number_may_be_a_variable_that_the_tree_has_set(release):
    tree = f'{SET.format(2.5, "pause")}{SET.format("Smac", "plans")}<Wait wait_duration="{{pause}}"/>{PLAN}{FOLLOW}'
    read = read_tree(xml_of(f"<Sequence>{tree.replace('GridBased', '{plans}')}</Sequence>"), release)
    assert read.children[2].ports["wait_duration"] == 2.5
    assert plugin_names(read)["planner_id"] == "Smac"


@pytest.mark.parametrize(("release", "tag"), [("humble", "SubTreePlus"), ("jazzy", "SubTree")])
def test_texts_that_a_subtree_is_given_are_its_variables(release, tag):
    main = f'<Sequence><{tag} ID="Rest" pause="1.5"/><{tag} ID="Rest" pause="2.5"/>{PLAN}{FOLLOW}</Sequence>'
    rest = '<BehaviorTree ID="Rest"><Wait wait_duration="{pause}"/></BehaviorTree>'
    read = read_tree(xml_of(main).replace("</root>", f"{rest}</root>"), release)
    assert [node.ports["wait_duration"] for node in read.children[:2]] == [1.5, 2.5]


def test_durations_of_timers_are_whole_milliseconds():
    read = read_tree(xml_of(f'<Timeout msec="1500">{DRIVE}</Timeout>'), "humble")
    assert read.ports["msec"] == 1.5


def test_selectors_name_the_plugins_of_variables():
    selector = '<PlannerSelector selected_planner="{chosen}" default_planner="Smac" topic_name="planner_selector"/>'
    tree = xml_of(f"<Sequence>{selector}{PLAN.replace('GridBased', '{chosen}')}{FOLLOW}</Sequence>")
    assert plugin_names(read_tree(tree, "jazzy"))["planner_id"] == "Smac"


@pytest.mark.parametrize(
    ("xml", "release", "message"),
    [
        ("<root", "humble", "not an XML file"),
        ("<tree/>", "humble", "expected <root> with a <BehaviorTree>"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><root/>', "humble", "plain XML"),
        (xml_of(DRIVE).replace('execute="Main"', 'execute="Man"'), "humble", "unknown tree 'Man'; did you mean 'Main'"),
        (xml_of(""), "humble", "BehaviorTree Main: expected one node in it, got 0"),
        (
            xml_of(f"<Sequence>{DRIVE}<Spinn/></Sequence>"),
            "humble",
            "Spinn: a node that is not built here; did you mean 'Spin'",
        ),
        (
            xml_of(f"<SequenceWithMemory>{DRIVE}</SequenceWithMemory>"),
            "humble",
            "SequenceWithMemory: a node of Jazzy and Lyrical",
        ),
        (xml_of(f"<Inverter>{DRIVE}{DRIVE}</Inverter>"), "humble", "Inverter: expected 1 children, got 2"),
        (
            xml_of(f"<Sequence>{DRIVE}<Fallback/></Sequence>"),
            "humble",
            "Fallback: expected one or more children, got 0",
        ),
        (
            xml_of(f'<RateController hz="fast">{DRIVE}</RateController>'),
            "humble",
            "RateController.hz: expected a number",
        ),
        (
            xml_of(f'<RateController name="Slow" hz="fast">{DRIVE}</RateController>'),
            "humble",
            "RateController 'Slow'.hz: expected a number, got 'fast'",
        ),
        (
            xml_of(f'<Inverter name="not yet">{DRIVE}{DRIVE}</Inverter>'),
            "humble",
            "Inverter 'not yet': expected 1 children, got 2",
        ),
        (
            xml_of(f'<IfThenElse name="which way">{DRIVE}<Wait/></IfThenElse>'),
            "humble",
            "IfThenElse 'which way': a node of BehaviorTree.CPP that is not built here",
        ),
        (
            xml_of(f'<Sequence>{PLAN}<FollowPath name="go" path="{{way}}"/></Sequence>'),
            "humble",
            "FollowPath 'go'.path: expected {path}, got {way}",
        ),
        (xml_of(f'<RateController hz="0">{DRIVE}</RateController>'), "humble", "hz: expected a number above 0, got 0"),
        (xml_of(f'<RateController rate="1">{DRIVE}</RateController>'), "humble", "unknown port 'rate'"),
        (xml_of(f'<Repeat num_cycles="1.5">{DRIVE}</Repeat>'), "humble", "num_cycles: expected a whole number"),
        (xml_of(f'<RoundRobin wrap_around="true">{DRIVE}</RoundRobin>'), "jazzy", "unknown port 'wrap_around'"),
        (
            xml_of(f"<Sequence>{PLAN}{FOLLOW.replace('{path}', '{way}')}</Sequence>"),
            "humble",
            "expected {path}, got {way}",
        ),
        (
            xml_of(f"<Sequence>{PLAN.replace('{path}', 'path')}{FOLLOW}</Sequence>"),
            "humble",
            "a variable such as {path}",
        ),
        (
            xml_of(f"<Sequence>{PLAN.replace('{goal}', '{aim}')}{FOLLOW}</Sequence>"),
            "humble",
            "expected {goal}, got {aim}",
        ),
        (xml_of(PLAN), "humble", "expected a node FollowPath"),
        (
            xml_of(f'<Sequence>{DRIVE}<ClearEntireCostmap service_name="x"/></Sequence>'),
            "humble",
            "service_name: expected",
        ),
        (
            xml_of(f'<SpeedController min_rate="2" max_rate="1">{DRIVE}</SpeedController>'),
            "humble",
            "min_rate: expected less than max_rate",
        ),
        (
            xml_of(f'<Sequence _skipIf="true">{DRIVE}</Sequence>'),
            "jazzy",
            "Sequence._skipIf: scripts are not built here",
        ),
        (xml_of(f'<SubTree ID="A" _while="x"/>{DRIVE}').replace(DRIVE, ""), "jazzy", "SubTree._while: scripts are not"),
        (xml_of("<ComputeRoute/>"), "lyrical", "ComputeRoute: there is no route server here"),
        (xml_of("<RemovePassedGoals/>"), "humble", "RemovePassedGoals: there is one goal here, not several"),
        (
            xml_of(f'<Sequence><Wait wait_duration="{{pause}}"/>{DRIVE}</Sequence>'),
            "jazzy",
            "Wait.wait_duration: expected a number, or a variable that a SetBlackboard before sets, got {pause}",
        ),
        (
            xml_of(f'<Sequence>{SET.format(1, "pause")}<Wait wait_duration="{{pause}}"/>{DRIVE}</Sequence>'),
            "humble",
            "Wait.wait_duration: expected a number, got {pause}: most nodes of Humble look before the tree sets it",
        ),
        (
            xml_of(f"<Sequence>{SET.format(1, 'a')}{SET.format(2, 'a')}{DRIVE}</Sequence>"),
            "jazzy",
            "SetBlackboard a: expected one text in the whole tree, got '1' and '2'",
        ),
        (
            xml_of(f"<Sequence>{SET.format('{path}', 'a')}{DRIVE}</Sequence>"),
            "jazzy",
            "SetBlackboard.value: expected a text without braces, got {path}",
        ),
        (
            xml_of(f"<Timeout>{DRIVE}</Timeout>"),
            "humble",
            "Timeout.msec: expected a whole number of milliseconds, got none",
        ),
        (xml_of(f'<Delay delay_msec="-5">{DRIVE}</Delay>'), "jazzy", "whole number of milliseconds, got -5"),
        (
            xml_of(f'<Parallel success_count="3">{DRIVE}<Wait/></Parallel>'),
            "jazzy",
            "Parallel.success_count: expected 1 to 2, or -2 to -1, got 3",
        ),
        (xml_of(f'<Parallel success_count="1">{DRIVE}</Parallel>'), "humble", "unknown port 'success_count'"),
        (
            xml_of(f'<Parallel failure_threshold="1">{DRIVE}</Parallel>'),
            "humble",
            "Parallel.success_threshold: expected a whole number, got none",
        ),
        (
            xml_of(f'<Sequence><ClearCostmapAroundRobot service_name="x"/>{DRIVE}</Sequence>'),
            "humble",
            "expected local_costmap/clear_around_local_costmap or global_costmap/clear_around_global_costmap, got 'x'",
        ),
        (xml_of("<Inverter>" * 2000 + DRIVE + "</Inverter>" * 2000), "humble", "at most 100 nodes from top to bottom"),
        (
            xml_of(DRIVE).replace("</root>", f'<BehaviorTree ID="Main">{DRIVE}</BehaviorTree></root>'),
            "humble",
            "expected a different ID for each",
        ),
        (
            xml_of(f'<Sequence><SmoothPath max_smoothing_duration="inf"/>{DRIVE}</Sequence>'),
            "humble",
            "SmoothPath.max_smoothing_duration: expected a finite number, got inf",
        ),
        (
            xml_of(f'<RateController hz="nan">{DRIVE}</RateController>'),
            "humble",
            "RateController.hz: expected a finite number, got nan",
        ),
        (
            xml_of(f"<Fallback>{DRIVE.replace('GridBased', '{chosen}')}{SET.format('Smac', 'chosen')}</Fallback>"),
            "jazzy",
            "ComputePathToPose.planner_id: expected a name that does not change, got {chosen}",
        ),
        (
            xml_of(f'<Sequence><ProgressCheckerSelector selected_progress_checker="{{a}}"/>{DRIVE}</Sequence>'),
            "humble",
            "ProgressCheckerSelector: a node of Jazzy and Lyrical",
        ),
        (
            xml_of(f'<Sequence><PathHandlerSelector selected_path_handler="{{a}}"/>{DRIVE}</Sequence>'),
            "jazzy",
            "PathHandlerSelector: a node of Lyrical, which Jazzy does not have",
        ),
        (subtrees(40), "humble", "at most 10000 nodes, 100 deep"),
        (xml_of(f"<RetryUntilSuccessful>{DRIVE}</RetryUntilSuccessful>"), "humble", "or -1 for no end, got none"),
        (xml_of(f'<Repeat num_cycles="0">{DRIVE}</Repeat>'), "humble", "whole number above 0, or -1 for no end, got 0"),
        (xml_of('<SubTree ID="Main"/>'), "humble", "SubTree Main: expected a tree without itself"),
    ],
)
def test_errors_say_what_is_wrong_in_one_line(xml, release, message):
    with pytest.raises(ConfigError) as error:
        read_tree(xml, release)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_two_plugins_of_one_kind_are_refused():
    second = FOLLOW.replace('FollowPath"', 'Docking"')
    with pytest.raises(
        ConfigError, match="controller_id: expected one in the whole tree, got 'FollowPath' and 'Docking'"
    ):
        plugin_names(read_tree(xml_of(f"<Sequence>{DRIVE}{second}</Sequence>"), "humble"))
