from benchbot.core.channels import ACTIONS, GIVEN_BY_EPISODES, OBSERVATIONS
from benchbot.core.declarations.schema import schema


def test_a_robot_may_connect_exactly_what_is_defined() -> None:
    offered = [name for name in OBSERVATIONS if name not in GIVEN_BY_EPISODES]
    assert schema("robot")["properties"]["connections"]["propertyNames"]["enum"] == [*offered, *ACTIONS]


def test_a_task_may_ask_for_exactly_what_is_defined() -> None:
    properties = schema("task")["properties"]
    assert properties["observations"]["items"]["enum"] == list(OBSERVATIONS)
    assert properties["actions"]["items"]["enum"] == list(ACTIONS)
