from itertools import product

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.request import RunRequest
from benchbot.core.selection import select
from benchbot.plugins.tui.choices import Possibilities, facts


def is_possible(catalog: Catalog, task: str, robot: str, environment: str) -> bool:
    try:
        select(catalog, RunRequest(task=task, robot=robot, environment=environment))
    except BenchbotError:
        return False
    return True


def test_what_can_be_chosen_is_what_can_be_run(catalog: Catalog) -> None:
    found = Possibilities(catalog)

    for task in found.tasks():
        any_robot = False
        for robot in found.robots(task.name):
            environments = found.environments(task.name, robot.name)
            for environment in environments:
                runs = is_possible(catalog, task.name, robot.name, environment.name)
                assert runs == (not environment.reasons)
            assert (not robot.reasons) == any(not environment.reasons for environment in environments)
            any_robot |= not robot.reasons
        assert (not task.reasons) == any_robot


def test_what_cannot_be_chosen_says_why(catalog: Catalog) -> None:
    found = Possibilities(catalog)

    robots = {choice.name: choice for choice in found.robots("sample:goal")}
    scenes = {choice.name: choice for choice in found.environments("sample:goal", "sample_robot")}

    assert robots["sample_robot"].reasons == ()
    assert {reason.title for reason in robots["walker"].reasons} > {
        "Nothing installed can run robots of type 'sim_walking'."
    }
    assert scenes["arena:1"].reasons == ()
    assert scenes["arena:2"].reasons[0].title == "There are no episodes of the task 'sample:goal' in 'arena:2'."


def test_a_task_of_two_scenes_is_offered_every_order_of_two(catalog: Catalog) -> None:
    names = Possibilities(catalog).environment_names("sample:two_scenes")

    assert {"arena:1:2", "arena:2:1"} <= set(names)
    assert all(len(name.split(":")) == 3 for name in names)
    assert not any(first == second for _, first, second in (name.split(":") for name in names))


def test_facts_are_told_of_everything_that_is_installed(catalog: Catalog) -> None:
    for kind in ("tasks", "robots", "environments", "examples"):
        for name in catalog.names(kind):
            rows = facts(catalog.get(kind, name))
            assert all(isinstance(value, str) for _, value in rows)
            assert ("From", catalog.get(kind, name).distribution) in rows
    robot = dict(facts(catalog.get("robots", "sample_robot")))
    assert robot["Camera"] == "48 × 32"
    assert robot["Laser"] == "36 beams, up to 10 m"


def test_combinations_are_told_apart_by_their_reasons(catalog: Catalog) -> None:
    found = Possibilities(catalog)
    for task, robot in product(("sample:passive", "nothing"), ("sample_robot", "nobody")):
        reasons = found.against(task, robot, "arena:1")
        assert len(reasons) == (task == "nothing") + (robot == "nobody")
