import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.plugin_manager import Plugins, installed
from benchbot.core.request import Limits, RunRequest
from benchbot.core.selection import ImpossibleError, select
from tests.plugin_factory import PluginFactory

CODE = """\
from importlib.resources import files
from benchbot.plugin import hookimpl
from benchbot.plugin import Evaluator, Simulator

HERE = files(__name__)

@hookimpl
def benchbot_tasks(): yield HERE / "tasks"
@hookimpl
def benchbot_robots(): yield HERE / "robots"
@hookimpl
def benchbot_environments(): yield HERE / "environments"
@hookimpl
def benchbot_simulators(): yield Simulator("sim_acme", create=None)
@hookimpl
def benchbot_evaluators():
    yield Evaluator("tidiness", "1", "T", frozenset({"tidy_map"}), frozenset(), None, None)
"""
FILES = {
    "tasks/tour.yaml": "name: tour\nactions: [move_next]\nobservations: [poses]\nlimits: {steps: 9}\n",
    "tasks/compare.yaml": "name: compare\nactions: [move_next]\nobservations: [poses, laser]\nscene_count: 2\n",
    "robots/cart.yaml": """\
name: cart
type: sim_acme
global_frame: map
robot_frame: base
poses: [base]
connections: {poses: {connection: ros_to_api}, move_next: {connection: api_to_ros}}
""",
    "robots/real.yaml": """\
name: real
type: acme_driver
global_frame: map
robot_frame: base
poses: [base]
connections: {poses: {connection: ros_to_api}}
""",
    "environments/room.yaml": """\
name: room
variant: 1
type: sim_acme
start_pose: [1, 0, 0, 0, 0, 0, 0]
trajectory_poses: [[1, 0, 0, 0, 1, 0, 0]]
""",
    "environments/room_2.yaml": """\
name: room
variant: 2
type: sim_acme
start_pose: [1, 0, 0, 0, 0, 0, 0]
trajectory_poses: [[1, 0, 0, 0, 1, 0, 0]]
""",
    "environments/void.yaml": """\
name: void
variant: 1
type: sim_acme
start_pose: [1, 0, 0, 0, 0, 0, 0]
robots: [bug]
""",
}


@pytest.fixture
def catalog(plugin_factory: PluginFactory) -> Catalog:
    plugin_factory.make("acme-world", CODE, FILES)
    return Catalog(Plugins([info for info in installed() if info.distribution == "acme-world"]))


def test_a_possible_run_is_selected(catalog: Catalog) -> None:
    selection = select(catalog, RunRequest(task="tour", robot="cart", environment="room:1", seed=7))
    assert selection.environment == "room:1"
    assert selection.actions == ("move_next",)
    assert selection.localisation == "ground_truth"
    assert selection.seed == 7
    assert selection.limits == Limits(steps=9)


def test_the_user_overrides_the_limits_of_the_task(catalog: Catalog) -> None:
    limits = Limits(steps=20, wall_time_s=3)
    assert select(catalog, RunRequest(task="tour", robot="cart", environment="room:1", limits=limits)).limits == limits


def test_one_reason_is_an_error_of_its_own(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="'tuor' is not a known task") as caught:
        select(catalog, RunRequest(task="tuor", robot="cart", environment="room:1"))
    assert "Did you mean 'tour'?" in caught.value.why
    assert caught.value.fix == "List them with: benchbot list tasks"


def test_every_reason_is_named_at_once(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="not possible, for 8 reasons") as caught:
        select(catalog, RunRequest(task="compare", robot="real", environment="void:1", method="omg"))
    for reason in (
        "does not offer the actions that the task 'compare' needs. Missing: move_next",
        "does not offer the observations that the task 'compare' needs. Missing: laser",
        "'real' cannot run in the environment 'void:1'. The robot runs in environments of type acme_driver,",
        "'void:1' is not made for the robot 'real'. It names these robots: bug.",
        "Nothing installed can run robots of type 'acme_driver'. Installed simulators and drivers: sim_acme.",
        "The task 'compare' needs 2 scenes, not 1.",
        "'void:1' has no trajectory.",
        "'omg' is not an installed evaluator.",
    ):
        assert reason in caught.value.why
    assert [line.partition(".")[0] for line in caught.value.why.splitlines()] == list("12345678")
    assert [line.partition(".")[0] for line in caught.value.fix.splitlines()] == list("12345678")
    assert "benchbot install benchbot-acme-driver" in caught.value.fix
    assert "--env NAME:VARIANT_1:VARIANT_2" in caught.value.fix


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (RunRequest("tuor", "cart", "room:1"), "'tuor' is not a known task"),
        (RunRequest("tuor", "cart", "room:1", method="tidiness"), "'tuor' is not a known task"),
        (RunRequest("tour", "crat", "room:1"), "'crat' is not a known robot"),
        (RunRequest("tour", "cart", "rom:1"), "'rom:1' is not a known environment"),
    ],
)
def test_one_wrong_name_is_the_only_reason(catalog: Catalog, request_: RunRequest, reason: str) -> None:
    with pytest.raises(BenchbotError, match=reason) as caught:
        select(catalog, request_)
    assert not isinstance(caught.value, ImpossibleError)


def test_a_task_with_one_scene_is_not_given_two(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="The task 'tour' needs 1 scene, not 2") as caught:
        select(catalog, RunRequest("tour", "cart", "room:1:2"))
    assert caught.value.why == "You named: room:1, room:2."
    assert caught.value.fix == "Name the scenes like this: --env NAME:VARIANT"


def test_a_robot_that_lacks_a_channel_says_what_it_offers(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="does not offer the observations") as caught:
        select(catalog, RunRequest("compare", "cart", "room:1:2"))
    assert caught.value.why == "Missing: laser. It offers: poses."


@pytest.mark.parametrize(
    "request_",
    [
        RunRequest("compare", "cart", "room:2:1", seed=3, limits=Limits(steps=5, wall_time_s=60.0)),
        RunRequest("tour", "cart", "room:1", settings={"lighting.time": "21:30"}, limits=Limits(steps=9)),
        RunRequest("tour", "cart", "room:1", limits=Limits(steps=9), secret=16 * "0f"),
    ],
)
def test_the_request_of_a_run_selects_the_same_run_again(catalog: Catalog, request_: RunRequest) -> None:
    catalog.get("robots", "cart").data["connections"]["laser"] = {"connection": "ros_to_api"}
    selection = select(catalog, request_)
    assert selection.request == request_
    assert select(catalog, selection.request) == selection


def test_a_method_must_read_the_format_of_the_task(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="'tidiness' cannot score results of the task 'tour'"):
        select(catalog, RunRequest(task="tour", robot="cart", environment="room:1", method="tidiness"))


def test_move_next_needs_a_trajectory(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError) as caught:
        select(catalog, RunRequest(task="tour", robot="cart", environment="void:1"))
    assert "The environment 'void:1' has no trajectory." in caught.value.why


def test_a_robot_may_say_in_which_worlds_it_runs(catalog: Catalog) -> None:
    catalog.get("robots", "cart").data["runs_in"] = ["real", "sim_acme"]
    assert select(catalog, RunRequest(task="tour", robot="cart", environment="room:1")).robot.name == "cart"
    catalog.get("robots", "cart").data["runs_in"] = ["real", "sim_other"]
    with pytest.raises(BenchbotError, match="'cart' cannot run in the environment 'room:1'") as caught:
        select(catalog, RunRequest(task="tour", robot="cart", environment="room:1"))
    assert "environments of type real or sim_other, this one is of type sim_acme" in caught.value.why


def test_a_run_in_a_hidden_place_needs_a_secret(catalog: Catalog) -> None:
    for scene in catalog.environments("room:1"):
        scene.data["hidden"] = True
    with pytest.raises(BenchbotError, match="'room:1' is hidden, and the run has no secret") as caught:
        select(catalog, RunRequest(task="tour", robot="cart", environment="room:1"))
    assert "--secret random" in caught.value.fix
    selection = select(catalog, RunRequest(task="tour", robot="cart", environment="room:1", secret=16 * "0f"))
    assert selection.commitment is not None


def test_settings_change_every_scene_of_a_run(catalog: Catalog) -> None:
    found = select(
        catalog, RunRequest(task="tour", robot="cart", environment="room:1", settings={"lighting.time": "21:30"})
    )

    assert found.settings == {"lighting.time": "21:30"}
    assert [scene.data["lighting"] for scene in found.environments] == [{"time": "21:30"}]
    assert "lighting" not in catalog.get("environments", "room:1").data


def test_settings_that_do_not_fit_are_among_the_reasons(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError) as caught:
        select(
            catalog, RunRequest(task="tour", robot="carrt", environment="room:1", settings={"lighting.time": "9.30"})
        )

    assert "for 2 reasons" in caught.value.title
    assert "lighting.time: '9.30' does not match" in caught.value.why


@pytest.mark.parametrize(
    ("environment", "reason"),
    [
        ("room:1", "Its scene is made from a finished one (none), not a layout"),
        ("loft:1", "Its scene is made from a finished one (room.glb), not a layout"),
        ("ring:1", "Installed: tools."),
        ("flat:1", "Installed: tools."),
    ],
)
def test_assets_need_a_layout_and_a_pack(environment: str, reason: str, plugin_factory: PluginFactory) -> None:
    flat = FILES["environments/room.yaml"].replace("name: room", "name: flat\nmap_path: .layouts/flat.yaml")
    pack = CODE.replace("import Evaluator", "import AssetPack, Evaluator")
    pack += '\n@hookimpl\ndef benchbot_asset_packs(): yield AssetPack("tools", HERE / "catalogue.json")\n'
    files = {f"environments/{name}.yaml": flat.replace("flat", name) for name in ("flat", "loft", "ring")}
    layouts = {
        "environments/.layouts/flat.yaml": "assets: tools\n",
        "environments/.layouts/loft.yaml": "base: b.yaml\n",
    }
    layouts["environments/.layouts/b.yaml"] = "base: room.glb\n"
    layouts["environments/.layouts/room.glb"] = "glTF: ["
    # Whoever loads it says that it goes round in a circle.
    layouts["environments/.layouts/ring.yaml"] = "base: ring.yaml\n"
    plugin_factory.make("acme-assets", pack, {**FILES, **files, **layouts})
    catalog = Catalog(Plugins([info for info in installed() if info.distribution == "acme-assets"]))

    with pytest.raises(BenchbotError) as caught:
        select(catalog, RunRequest(task="tour", robot="cart", environment=environment, settings={"assets": "toolls"}))

    assert reason in caught.value.why
    select(catalog, RunRequest(task="tour", robot="cart", environment="flat:1", settings={"assets": "tools"}))
