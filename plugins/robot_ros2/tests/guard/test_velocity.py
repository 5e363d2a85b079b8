"""The robot's safety devices and clock: what stops a robot that is driven as it should be."""

import threading
from collections.abc import Iterator

import pytest

from benchbot.core.errors import BenchbotError
from benchbot_robot_ros2.ros import running_node
from plugins.robot_ros2.tests.guard import guarded
from plugins.robot_ros2.tests.guard.guarded import Base, Driving, declaration, until


@pytest.fixture
def base(domain: int) -> Iterator[Base]:
    from geometry_msgs.msg import Twist

    with running_node("base") as node:
        yield Base(node, Twist)


def test_the_emergency_stop_stops_the_robot(base: Base) -> None:
    from std_msgs.msg import Bool

    button = base.node.create_publisher(Bool, "/e_stop", 1)
    e_stop = {"ros_topic": "/e_stop", "ros_type": "std_msgs/msg/Bool"}
    with guarded.guarded(declaration({"e_stop": e_stop})) as guard, Driving(guard) as driving:
        base.until_moving()
        until(button.get_subscription_count, "the guard listens to the button")
        button.publish(Bool(data=False))
        button.publish(Bool(data=True))
        assert "emergency stop is pressed" in driving.until_refused().why
        base.until_stopped()
        button.publish(Bool(data=False))
        assert guard.tripped


def test_anybody_can_stop_the_robot_by_a_service(base: Base) -> None:
    from std_srvs.srv import Trigger

    client = base.node.create_client(Trigger, "/benchbot/stop")
    with guarded.guarded(declaration()) as guard, Driving(guard) as driving:
        base.until_moving()
        until(client.service_is_ready, "the guard offers to stop")
        answer = client.call(Trigger.Request(), timeout_sec=guarded.DEADLINE_S)
        assert answer is not None
        assert answer.success
        assert driving.until_refused().why == "Somebody stopped it by the service /benchbot/stop."
        base.until_stopped()


def test_anybody_can_stop_the_robot_by_a_topic_that_says_true(base: Base) -> None:
    from std_msgs.msg import Bool

    button = base.node.create_publisher(Bool, "/benchbot/stop", 1)
    with guarded.guarded(declaration()) as guard, Driving(guard) as driving:
        base.until_moving()
        # The guard, and the one that stands by.
        until(lambda: button.get_subscription_count() == 2, "the guards listen")
        button.publish(Bool(data=False))
        base.forget()
        base.until_moving()
        assert guard.tripped is None
        button.publish(Bool(data=True))
        assert driving.until_refused().why == "Somebody stopped it by the topic /benchbot/stop."
        base.until_stopped()


@pytest.mark.parametrize("topic", ["/benchbot/stop", "/r1/benchbot/stop"])
def test_a_robot_of_a_fleet_is_stopped_by_its_own_topic_and_by_that_of_all(domain: int, topic: str) -> None:
    from geometry_msgs.msg import Twist
    from std_msgs.msg import Bool

    with running_node("base") as node:
        base, button = Base(node, Twist, "/r1/cmd_vel"), node.create_publisher(Bool, topic, 1)
        with guarded.guarded(declaration(namespace="r1")) as guard, Driving(guard) as driving:
            base.until_moving()
            until(lambda: button.get_subscription_count() == 2, "the guards listen")
            button.publish(Bool(data=True))
            assert driving.until_refused().why == f"Somebody stopped it by the topic {topic}."
            base.until_stopped()


def test_an_emergency_stop_that_is_gone_stops_the_robot(base: Base) -> None:
    from std_msgs.msg import Bool

    e_stop = {"ros_topic": "/e_stop", "ros_type": "std_msgs/msg/Bool"}
    with running_node("button") as node:
        button = node.create_publisher(Bool, "/e_stop", 1)
        with guarded.guarded(declaration({"e_stop": e_stop})) as guard, Driving(guard) as driving:
            base.until_moving()
            node.executor.create_task(node.destroy_publisher, button)
            assert "emergency stop is gone" in driving.until_refused().why
            base.until_stopped()


def test_a_declared_emergency_stop_must_be_there(base: Base) -> None:
    e_stop = {"ros_topic": "/e_stop", "ros_type": "std_msgs/msg/Bool"}
    robot = declaration({"e_stop": e_stop}, timing={"wait_s": 1.0})
    with pytest.raises(BenchbotError, match="has no emergency stop"), guarded.guarded(robot):
        pass
    assert not base.messages


def test_an_emergency_stop_of_another_type_is_an_error(base: Base) -> None:
    from std_msgs.msg import String

    base.node.create_publisher(String, "/e_stop", 1)
    robot = declaration({"e_stop": {"ros_topic": "/e_stop", "ros_type": "std_msgs/msg/Bool"}})
    with pytest.raises(BenchbotError, match="cannot be heard") as caught, guarded.guarded(robot):
        pass
    assert "std_msgs/msg/String" in caught.value.why


@pytest.mark.parametrize("kind", ["std_msgs/msg/Bool", "sensor_msgs/msg/Joy"])
def test_the_robot_moves_while_the_dead_man_switch_is_held(base: Base, kind: str) -> None:
    from sensor_msgs.msg import Joy
    from std_msgs.msg import Bool

    joy = kind == "sensor_msgs/msg/Joy"
    switch = base.node.create_publisher(Joy if joy else Bool, "/switch", 1)
    dead_man = {"ros_topic": "/switch", "ros_type": kind, "button": 1, "timeout_s": 5.0}

    def say(*, held: bool) -> None:
        switch.publish(Joy(buttons=[0, int(held)]) if joy else Bool(data=held))

    with guarded.guarded(declaration({"dead_man": dead_man})) as guard:
        until(switch.get_subscription_count, "the guard listens to the switch")
        ended = threading.Event()
        said: list[bool] = []

        def hold() -> None:
            while not ended.wait(0.02):
                say(held=True)
                said.append(True)

        holding = threading.Thread(target=hold)
        holding.start()
        # Some of what was said before the first command must have been heard.
        until(lambda: len(said) > 20, "the switch is held")
        with Driving(guard) as driving:
            base.until_moving()
            ended.set()
            holding.join()
            say(held=False)
            assert "dead-man" in driving.until_refused().why
        base.until_stopped()


def test_without_a_held_dead_man_switch_the_robot_does_not_move(base: Base) -> None:
    dead_man = {"ros_topic": "/switch", "ros_type": "std_msgs/msg/Bool"}
    with guarded.guarded(declaration({"dead_man": dead_man})) as guard, Driving(guard) as driving:
        assert driving.until_refused().why == "Nobody holds the dead-man switch."
        base.until_stopped()
        assert set(base.heard) == {(0.0, 0.0)}


class Clock:
    """Publishes simulated time, for as long as it is not stopped."""

    def __init__(self, base: Base) -> None:
        from rosgraph_msgs.msg import Clock as ClockMessage

        self.time_s = 100.0
        self._message = ClockMessage()
        self._publisher = base.node.create_publisher(ClockMessage, "/clock", 10)
        self.timer = base.node.create_timer(0.02, self.tick)

    def tick(self) -> None:
        self.time_s += 0.02
        self.publish()

    def publish(self) -> None:
        self._message.clock.sec, rest = divmod(self.time_s, 1)
        self._message.clock.sec, self._message.clock.nanosec = int(self.time_s), int(rest * 1e9)
        self._publisher.publish(self._message)


def test_a_clock_that_stands_still_stops_the_robot(base: Base) -> None:
    clock = Clock(base)
    with guarded.guarded(declaration(use_sim_time=True)) as guard, Driving(guard) as driving:
        base.until_moving()
        clock.timer.cancel()
        assert "clock has stood still" in driving.until_refused().why
        base.until_stopped()


def test_a_clock_that_jumps_back_stops_the_robot(base: Base) -> None:
    clock = Clock(base)
    with guarded.guarded(declaration(use_sim_time=True)) as guard, Driving(guard) as driving:
        base.until_moving()
        clock.time_s -= 50.0
        assert "clock jumped back by" in driving.until_refused().why
        base.until_stopped()


def test_a_simulated_robot_needs_its_clock(base: Base) -> None:
    robot = declaration(use_sim_time=True, timing={"wait_s": 1.0})
    with pytest.raises(BenchbotError, match="has no clock"), guarded.guarded(robot):
        pass
