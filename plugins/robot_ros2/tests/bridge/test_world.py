"""The bridged robot's own rules, without DDS: how long a command holds, and how its time goes."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.cli.app import main
from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot_robot_ros2.bridge import camera_channel
from benchbot_robot_ros2.bridge import robot as names
from benchbot_robot_ros2.bridge.camera_channel import Failed, Load, Look, Message, Ready
from benchbot_robot_ros2.bridge.pace import Rate, SimulatedTime, WallTime
from benchbot_robot_ros2.bridge.robot import BridgedRobot
from benchbot_robot_ros2.bridge.world import World
from benchbot_robot_ros2.declaration import Ros2Robot
from benchbot_robot_ros2.declaration_keys import LocalisedByTopic, ReturnByService
from benchbot_robot_ros2.ramp import REST, Velocity
from plugins.robot_ros2.tests.bridge.bridged import simulator
from tests.garbage import searched_as_before

CATALOG = Catalog(plugin_manager.load())
SAMPLE = CATALOG.get("robots", "sample_robot").data


def arena() -> Any:
    return names.find_scene(CATALOG, SAMPLE, "arena:1")


@pytest.fixture
def world() -> World:
    platform = simulator("arena:1")
    made = World(platform, SimulatedTime(platform.control_period_s), SAMPLE["noise"])
    made.load(arena(), seed=0)
    return made


def test_a_command_holds_for_three_ticks_and_then_the_robot_brakes(world: World) -> None:
    for _ in range(20):
        world.command(Velocity(0.5, 0.3))
        world.tick()
    speeds = []
    for _ in range(9):
        world.tick()
        speeds.append(world.velocity[0])

    # The last command is one tick old; 2 m/s² take 0.1 m/s a tick.
    assert speeds == pytest.approx([0.5, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0, 0.0, 0.0], abs=1e-9)
    assert world.velocity == REST


@pytest.mark.parametrize("interrupt", ["load", "place"])
def test_a_command_from_before_does_not_move_a_robot_that_was_carried(world: World, interrupt: str) -> None:
    world.command(Velocity(0.5, 0.0))
    world.tick()
    if interrupt == "load":
        world.load(arena(), seed=0)
    else:
        world.place(Pose.planar(-2.0, 0.0, 0.0))
    world.tick()

    assert world.pose() == Pose.planar(-2.0, 0.0, 0.0)
    assert world.velocity == REST


def test_odometry_begins_anew_with_a_scene_and_time_goes_on(world: World) -> None:
    for _ in range(10):
        world.command(Velocity(0.5, 0.5))
        world.tick()
    assert world.odometry() != Pose()
    assert world.stamp_ns == 500_000_000

    world.load(arena(), seed=0)

    assert world.odometry() == Pose()
    assert world.stamp_ns == 500_000_000
    world.tick()
    assert world.stamp_ns == 550_000_000


def test_odometry_is_in_the_frame_of_the_start_and_carrying_does_not_move_it(world: World) -> None:
    world.place(Pose.planar(1.0, 0.0, math.pi / 2))
    assert world.odometry() == Pose()
    for _ in range(20):
        world.command(Velocity(0.3, 0.0))
        world.tick()
    x, y, _ = world.odometry().translation_xyz

    # It drove along the map's +y, and believes to have driven along its own +x, with 10 % noise a tick.
    assert world.pose().translation_xyz[1] > 0.2
    assert x == pytest.approx(world.pose().translation_xyz[1], rel=0.2)
    assert y == pytest.approx(0.0, abs=1e-9)


def test_a_robot_is_not_placed_into_something(world: World) -> None:
    before = world.pose()
    with pytest.raises(BenchbotError, match="does not fit"):
        world.place(Pose.planar(1.5, 1.2, 0.0))
    assert world.pose() == before
    assert not world.collided


@given(
    st.floats(0.5, 30.0),
    st.lists(st.integers(1, 400_000_000), min_size=1, max_size=200),
    st.integers(0, 2 * 10**18),
)
def test_a_rate_is_kept_on_average_and_never_made_up_for(rate_hz: float, gaps_ns: list[int], start_ns: int) -> None:
    rate, stamp_ns, times = Rate(rate_hz), start_ns, []
    for gap_ns in gaps_ns:
        stamp_ns += gap_ns
        if rate.due(stamp_ns):
            times.append(stamp_ns)

    assert times[0] == start_ns + gaps_ns[0]
    period_ns = 1e9 / rate_hz
    # At most one more than fits, wherever one begins to count.
    for index in range(1, len(times)):
        assert index - 1 <= (times[-1] - times[-1 - index]) / period_ns + 1 + 1e-6


def test_ticks_of_a_steady_clock_give_the_rate() -> None:
    rate = Rate(15)
    assert sum(rate.due(tick * 50_000_000) for tick in range(1, 401)) == pytest.approx(15 * 20, abs=1)


def test_wall_time_never_jumps_back_and_a_late_tick_is_cut_short(monkeypatch: pytest.MonkeyPatch) -> None:
    system_ns, steady_s = iter([10**18, 10**18 + 50_000_000, 10**17, 10**18 + 100_000_000]), iter([0.0, 0.05, 0.1, 9.0])
    clocks = SimpleNamespace(time_ns=lambda: next(system_ns), monotonic=lambda: next(steady_s))
    monkeypatch.setattr("benchbot_robot_ros2.bridge.pace.time", clocks)
    wall = WallTime(0.05)
    ticks = [(wall.next_tick(), wall.stamp_ns) for _ in range(3)]

    assert [stamp for _, stamp in ticks] == [10**18 + 50_000_000, 10**18 + 50_000_001, 10**18 + 100_000_000]
    assert [duration for duration, _ in ticks] == pytest.approx([0.05, 0.05, 0.15])


def test_the_camera_takes_the_newest_pose_but_misses_no_scene() -> None:
    ours, theirs = camera_channel.pair()
    first, second = Look(1, Pose()), Look(2, Pose.planar(1, 2, 3))
    load = Load({"name": "arena"}, "/scenes", 4)
    messages: list[Message] = [first, second, load, second, first]
    with ours, theirs:
        for message in messages:
            camera_channel.send(ours, message)
        received = [camera_channel.receive_newest(theirs) for _ in range(2)]
        ours.close()
        received += [camera_channel.receive_newest(theirs) for _ in range(2)]

    # The two looks before the scene are of another one.
    assert received == [load, first, None, None]


def test_a_camera_that_does_not_listen_holds_nobody_up() -> None:
    ours, theirs = camera_channel.pair()

    def flood() -> None:
        while True:
            camera_channel.send(ours, Look(0, Pose()), wait=False)

    with ours, theirs, pytest.raises(BlockingIOError):
        flood()


def test_a_scene_and_an_error_survive_the_way_to_the_camera() -> None:
    scene = arena()
    error = BenchbotError("It is dark.", "The lamp is off.", "Switch it on.")
    ours, theirs = camera_channel.pair()
    with ours, theirs:
        for message in (Load.of(scene, 3), Failed.of(error), Ready()):
            camera_channel.send(ours, message)
        load, failed, ready = (camera_channel.receive(theirs) for _ in range(3))

    assert isinstance(load, Load)
    assert load.scene().start_pose == scene.start_pose
    assert load.scene().folder == scene.folder
    assert load.seed == 3
    assert isinstance(failed, Failed)
    assert failed.error().as_dict() == error.as_dict()
    assert ready == Ready()


def test_the_names_are_those_that_carter_ros2_is_driven_by() -> None:
    carter = Ros2Robot.from_declaration(CATALOG.get("robots", "carter_ros2").data)
    settings = carter.settings
    assert carter.command.ros_topic == f"/{names.COMMAND}"
    assert settings.odometry.ros_topic == f"/{names.ODOMETRY}"
    assert isinstance(settings.localisation, LocalisedByTopic)
    assert settings.localisation.ros_topic == f"/{names.GROUND_TRUTH}"
    assert isinstance(settings.return_to_start, ReturnByService)
    assert settings.return_to_start.ros_service == f"/{names.RESET}"
    assert settings.return_to_start.scene_node == f"/{names.NODE}"
    assert settings.safety.collision is not None
    assert settings.safety.collision.ros_topic == f"/{names.COLLISION}"

    bridged = BridgedRobot(CATALOG.get("robots", "carter").data, "", {}, "unused")
    assert (bridged.sensor_frame("image_rgb"), bridged.sensor_frame("laser")) == (carter.camera_frame, "lidar")
    assert {*bridged.pictures, "laser", "imu", "poses"} == set(carter.observations)


def test_a_lidar_has_the_topic_that_carter_lidar_ros2_listens_to() -> None:
    bridged = BridgedRobot(CATALOG.get("robots", "carter_lidar").data, "", {}, "unused")
    listening = Ros2Robot.from_declaration(CATALOG.get("robots", "carter_lidar_ros2").data)
    assert bridged.scanners == ("laser", "lidar")
    assert names.topics("lidar") == listening.observations["lidar"].parts()
    assert bridged.sensor_frame("lidar") == listening.lidar_frame == "velodyne"


def test_a_robot_has_the_topics_of_its_own_connections_only() -> None:
    blind = BridgedRobot({**SAMPLE, "connections": {"poses": {}, "move_angle": {}}}, "", {}, "unused")
    assert blind.pictures == ()
    assert blind.scanners == ()
    assert blind.has("poses")


@pytest.mark.parametrize(
    ("words", "title"),
    [
        ("--robot nobody --env arena:1", "'nobody' is not a known robot."),
        ("--robot carter_ros2 --env arena:1", "The robot 'carter_ros2' cannot be bridged."),
        ("--robot sample_robot --env arena:9", "'arena:9' is not a known environment."),
        ("--robot sample_robot --env arena", "'arena' does not name an environment."),
        ("--robot sample_robot --env arena:1:2", "'arena:1:2' names 2 scenes."),
        ("--robot sample_robot --env miniroom:1", "The robot 'sample_robot' cannot run in"),
        ("--robot sample_robot --env arena:1 --seed -1", "Invalid value for '--seed'"),
        ("--robot sample_robot --env arena:1 --laser-rate-hz 0", "Invalid value for '--laser-rate-hz'"),
        ("--robot sample_robot", "Missing option '--env'"),
    ],
)
def test_what_cannot_be_bridged_is_explained(words: str, title: str, capsys: pytest.CaptureFixture[str]) -> None:
    with searched_as_before(), pytest.raises(SystemExit) as ended:
        main(["bridge", "ros2", *words.split()])

    assert ended.value.code == 2
    assert title in capsys.readouterr().err
