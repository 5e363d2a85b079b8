import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import Plugins, installed
from benchbot.evaluation.ground_truths import GroundTruths
from tests.plugin_factory import DECLARES, PluginFactory

ROOM = "name: room\nvariant: {variant}\ntype: sim_none\nstart_pose: [1, 0, 0, 0, 0, 0, 0]\n"
TASK = "name: {name}\nactions: [move_next]\nobservations: [poses]\n"


def catalog(*distributions: str) -> Catalog:
    return Catalog(Plugins([info for info in installed() if info.distribution in distributions]))


@pytest.fixture
def rooms(plugin_factory: PluginFactory) -> Catalog:
    files = {f"environments/{variant}.yaml": ROOM.format(variant=variant) for variant in (1, 2)}
    plugin_factory.make("acme-rooms", DECLARES.format(kind="environments"), files)
    return catalog("acme-rooms")


def test_environments_are_known_by_name_and_variant(rooms: Catalog) -> None:
    assert rooms.names("environments") == ["room:1", "room:2"]
    assert [scene.name for scene in rooms.environments("room:2:1")] == ["room:2", "room:1"]
    assert rooms.get("environments", "room:1").path.name == "1.yaml"


@pytest.mark.parametrize("text", ["room", "room:", ":1", "room::2", ""])
def test_an_environment_needs_a_variant(rooms: Catalog, text: str) -> None:
    with pytest.raises(BenchbotError, match="does not name an environment"):
        rooms.environments(text)


def test_an_unknown_name_is_answered_with_the_nearest(rooms: Catalog) -> None:
    with pytest.raises(BenchbotError, match="'rom:1' is not a known environment") as caught:
        rooms.environments("rom:1")
    assert "Did you mean 'room:1'?" in caught.value.why


TOWNS = """
from pathlib import Path
from benchbot.plugin import BenchbotError, EnvironmentSet, hookimpl

def make(number):
    if number == 3:
        raise BenchbotError("town_3:1 came out different.", "It was frozen by another version.", "Install that.")
    folder = Path(__file__).parent / "made" / str(number)
    for kind in ("environments", "ground_truths"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    about = f"name: town_{number}\\nvariant: 1\\ntype: sim_none\\nstart_pose: [1, 0, 0, 0, 0, 0, 0]\\n"
    (folder / "environments" / f"town_{number}_1.yaml").write_text(about)
    text = '{"environment": {"name": "town_%d", "variant": 1}, "format": {"name": "map"}, "ground_truth": {}}'
    (folder / "ground_truths" / f"town_{number}_1.json").write_text(text % number)
    return folder

@hookimpl
def benchbot_environment_sets():
    yield EnvironmentSet("town", 3, make)
"""


@pytest.fixture
def towns(plugin_factory: PluginFactory) -> Catalog:
    plugin_factory.make("acme-towns", TOWNS)
    return catalog("acme-towns")


def test_an_environment_of_a_set_is_made_when_it_is_asked_for(towns: Catalog) -> None:
    assert towns.names("environments") == []
    assert [scene.path.name for scene in towns.environments("town_2:1")] == ["town_2_1.yaml"]
    assert towns.get("environments", "town_2:1").distribution == "acme-towns"
    truths = GroundTruths.of(towns, None)
    assert truths.find("town_1:1", {"map"})["environment"]["name"] == "town_1"


def test_a_set_has_the_environments_that_it_says(towns: Catalog) -> None:
    for end in ("0:1", "4:1", "01:1", "1:2", "x:1", ":1", "1"):
        assert towns.find("environments", f"town_{end}") is None
    with pytest.raises(BenchbotError, match="'town_4:1' is not a known environment") as caught:
        towns.environments("town_4:1")
    assert "town_1:1 to town_3:1" in caught.value.why
    with pytest.raises(BenchbotError, match="There is no ground truth of the environment 'town_4:1'"):
        GroundTruths.of(towns, None).find("town_4:1", {"map"})
    with pytest.raises(BenchbotError, match="town_3:1 came out different"):
        towns.environments("town_3:1")


def test_what_a_set_has_nobody_else_declares(plugin_factory: PluginFactory) -> None:
    plugin_factory.make("acme-towns", TOWNS)
    room = ROOM.format(variant=1).replace("room", "town_2")
    plugin_factory.make("acme-rooms", DECLARES.format(kind="environments"), {"environments/town.yaml": room})
    with pytest.raises(BenchbotError, match="Two environments are called 'town_2:1'"):
        catalog("acme-towns", "acme-rooms").names("environments")


def test_a_name_declared_twice_names_both_distributions(plugin_factory: PluginFactory) -> None:
    for name in ("acme-one", "acme-two"):
        plugin_factory.make(name, DECLARES.format(kind="tasks"), {"tasks/t.yaml": TASK.format(name="same")})
    with pytest.raises(BenchbotError, match="Two tasks are called 'same'") as caught:
        catalog("acme-one", "acme-two").names("tasks")
    assert "'acme-one' and 'acme-two'" in caught.value.why


def test_an_unreadable_declaration_is_reported_and_harms_no_other(plugin_factory: PluginFactory) -> None:
    files = {"tasks/bad.yaml": "name: [", "tasks/nameless.yaml": "a: 1", "tasks/good.yaml": TASK.format(name="good")}
    plugin_factory.make("acme-tasks", DECLARES.format(kind="tasks"), files)
    tasks = catalog("acme-tasks")
    assert tasks.names("tasks") == ["good"]
    assert sorted(error.title.rpartition("/")[2] for error in tasks.broken) == [
        "bad.yaml:2: not valid YAML.",
        "nameless.yaml has no name.",
    ]


def test_a_declaration_is_validated_when_it_is_taken(plugin_factory: PluginFactory) -> None:
    plugin_factory.make("acme-tasks", DECLARES.format(kind="tasks"), {"tasks/t.yaml": "name: t\nactons: []\n"})
    tasks = catalog("acme-tasks")
    assert tasks.names("tasks") == ["t"]
    with pytest.raises(BenchbotError, match=r"t\.yaml is not a valid task") as caught:
        tasks.get("tasks", "t")
    assert "Did you mean 'actions'?" in caught.value.why


def test_ground_truths_are_files_apart(plugin_factory: PluginFactory) -> None:
    files = {"ground_truths/room_1.json": "{}", "ground_truths/note.txt": ""}
    plugin_factory.make("acme-truths", DECLARES.format(kind="ground_truths"), files)
    assert [path.name for path in catalog("acme-truths").ground_truth_files] == ["room_1.json"]


ROBOT = """\
name: {name}
type: {kind}
global_frame: map
robot_frame: base
poses: [base]
connections: {{poses: {{connection: ros_to_api}}}}
driver: {{odometry: odom, safety: {{e_stop: /stop}}}}
"""
FLEET = "fleet: {left: {namespace: l}, right: {safety: {battery: low}}}\n"


def robots(plugin_factory: PluginFactory, *texts: str) -> Catalog:
    files = {f"robots/{number}.yaml": text for number, text in enumerate(texts)}
    plugin_factory.make("acme-robots", DECLARES.format(kind="robots"), files)
    return catalog("acme-robots", "benchbot-sample")


def test_the_robots_of_a_fleet_are_known_one_by_one_each_with_its_own_settings(plugin_factory: PluginFactory) -> None:
    known = robots(plugin_factory, ROBOT.format(name="cart", kind="acme") + FLEET)
    assert {name for name in known.names("robots") if "cart" in name} == {"cart@left", "cart@right"}
    left, right = (known.get("robots", f"cart@{member}") for member in ("left", "right"))
    assert left.data["name"] == left.name == "cart@left"
    assert left.data["driver"] == {"odometry": "odom", "safety": {"e_stop": "/stop"}, "namespace": "l"}
    # What a member changes is put into what is common: no safety device is lost.
    assert right.data["driver"] == {"odometry": "odom", "safety": {"e_stop": "/stop", "battery": "low"}}
    for unknown in ("cart", "cart@middle"):
        with pytest.raises(BenchbotError, match="is not a known robot"):
            known.get("robots", unknown)


def test_a_real_robot_without_a_fleet_is_chosen_by_its_namespace(plugin_factory: PluginFactory) -> None:
    known = robots(plugin_factory, ROBOT.format(name="cart", kind="acme"))
    assert known.get("robots", "cart@lab/r1").data["driver"]["namespace"] == "lab/r1"
    assert "namespace" not in known.get("robots", "cart").data["driver"]
    assert known.names("robots").count("cart@lab/r1") == 0
    for unknown in ("cart@", "@r1", "card@r1"):
        with pytest.raises(BenchbotError, match="is not a known robot"):
            known.get("robots", unknown)


def test_a_simulated_robot_has_no_namespace(plugin_factory: PluginFactory) -> None:
    known = robots(plugin_factory, ROBOT.format(name="cart", kind="sim_sample"))
    with pytest.raises(BenchbotError, match="'cart@r1' is not a known robot") as caught:
        known.get("robots", "cart@r1")
    assert "Did you mean 'cart'?" in caught.value.why


@pytest.mark.parametrize("fleet", ["fleet: []\n", "fleet: {}\n", "fleet: {r1: fast}\n", "fleet: {r 1: {}}\n"])
def test_what_is_no_fleet_is_refused_when_the_robot_is_taken(plugin_factory: PluginFactory, fleet: str) -> None:
    known = robots(plugin_factory, ROBOT.format(name="cart", kind="acme") + fleet)
    (name,) = (name for name in known.names("robots") if "cart" in name)
    with pytest.raises(BenchbotError, match="fleet"):
        known.get("robots", name)
