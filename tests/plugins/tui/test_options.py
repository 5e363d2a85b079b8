"""Everything that the commands do can be driven: each of their options has a field, or a field for more takes it."""

from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pytest
from click import Context
from textual.pilot import Pilot
from textual.screen import Screen
from textual.widgets import Input

from benchbot.cli.app import EVERYDAY, Stub
from benchbot.core import plugin_manager
from benchbot.core.request import Limits, RunRequest
from benchbot.plugins.batch.screen import LISTS, NewBatchScreen
from benchbot.plugins.doctor.screen import MACHINES, DoctorScreen
from benchbot.plugins.installer.screen import PluginsScreen
from benchbot.plugins.report.screen import OVER, YES, CompareScreen
from benchbot.plugins.screens.widgets import CheckList, Table, TextField
from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.forms import SolutionForm, run_words, submit_words
from benchbot.plugins.tui.jobs import Alive
from benchbot_scenes.screen import GENERATE, IMPORT, EnvironmentsScreen
from tests.plugins.tui.playing import play, until

S = TypeVar("S", bound=Screen[None])
NOWHERE = {
    "--json": "screens read it",
    "--display": "the screens are a display",
    "--list-": "lists stand on the screens",
    "--show-": "details stand beside them",
}
"""The beginnings of options that no screen needs to offer, and why."""
FIELDS = {
    "batch": "task robots envs example seeds repeats evaluate-with jobs output-location",
    "compare": "score over objects",
    "install": "index-url",
    "upgrade": "index-url",
    "uninstall": "",
    "import-environment": "units up labels start name output-location robot",
    "generate-environment": "kind rooms seed name output-location robot",
    "doctor": "warm robot",
    "run": "task robot env seed episode max-steps max-simulated-time max-wall-time port",
    "submit": "task robot env seed episode max-steps max-simulated-time max-wall-time native results-location",
}
"""The options for which the screens of a command have a field, or which they give by themselves."""
RUN = RunRequest("t", "r", "e:1", 3, 1, limits=Limits(5, 6.0, 7.0))


def test_every_option_of_the_commands_can_be_given_on_their_screens(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("BENCHBOT_PLUGINS")
    monkeypatch.setattr(DoctorScreen, "action_look", lambda screen: None)  # it would start every simulator
    commands = dict(_commands())
    more = {name: " ".join(_typed(command)) for name, command in commands.items()}
    said: dict[str, list[str]] = {name: [] for name in FIELDS}

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        for fill in (_batch, _compare, _plugins, _environments, _doctor, _run_and_submit):
            async for name, words in fill(app, pilot, more):
                said[name] += _given(commands[name], words)

    play(BenchbotApp(look=Alive), scenario, (120, 40))
    for name, fields in FIELDS.items():
        assert {f"--{field}" for field in fields.split()} <= set(said[name]), name
        missing = [option.opts[0] for option in _offered(commands[name]) if option.opts[0] not in said[name]]
        assert not missing, f"{name}: {missing} can be given on no screen."


Words = AsyncIterator[tuple[str, Sequence[str]]]
"""Names of commands, each with the words after it that a screen gives."""


async def _batch(app: BenchbotApp, pilot: Pilot[None], more: Mapping[str, str]) -> Words:
    screen = await _opened(app, pilot, NewBatchScreen())
    await until(pilot, lambda: bool(screen._choices))
    for name in LISTS:
        screen.query_one(f"#{name}", CheckList).offer({"a": "a", "b": "b"}, ["a"])
    _fill(screen)
    screen._commands_field.value, screen._more_field.value = "", more["batch"]
    yield "batch", screen.words()[1:]


async def _compare(app: BenchbotApp, pilot: Pilot[None], more: Mapping[str, str]) -> Words:
    screen = await _opened(app, pilot, CompareScreen())
    _fill(screen)
    screen._others_field.value = "a=a; b=b"
    screen._over_field.value, screen._objects_field.value = OVER[1][1], YES
    screen._more_field.value = more["compare"]
    yield "compare", screen.words()[1:]


async def _plugins(app: BenchbotApp, pilot: Pilot[None], more: Mapping[str, str]) -> Words:
    screen = await _opened(app, pilot, PluginsScreen())
    ran: list[Sequence[str]] = []
    screen.run_command = lambda words, *_, **__: ran.append(words)  # type: ignore[method-assign]
    await until(pilot, lambda: screen.query_one(Table).marked not in (None, "benchbot"))
    screen._index_field.value = "http://127.0.0.1:9"
    for name, act in (("upgrade", screen.action_upgrade), ("uninstall", screen.action_uninstall)):
        screen._more_field.value = more[name]
        act()
    screen._more_field.value = more["install"]
    screen._search_field.value = "./here"
    screen._search_field.focus_input()
    assert screen.words()[0] == "install"
    await pilot.press("enter")
    await until(pilot, lambda: len(ran) == 3)
    for words in ran:
        yield words[0], words[1:]


async def _environments(app: BenchbotApp, pilot: Pilot[None], more: Mapping[str, str]) -> Words:
    screen = await _opened(app, pilot, EnvironmentsScreen())
    _fill(screen)
    for way in (GENERATE, IMPORT):
        screen._way_field.value, screen._units_field.value, screen._up_field.value = way, "m", "z"
        screen._more_field.value = more[f"{way}-environment"]
        yield f"{way}-environment", screen.words()[1:]


async def _doctor(app: BenchbotApp, pilot: Pilot[None], more: Mapping[str, str]) -> Words:
    screen = await _opened(app, pilot, DoctorScreen())
    screen._what_field.offer([*MACHINES, ("a robot", "real")])
    for _, value in (*MACHINES, ("a robot", "real")):
        screen._what_field.value = value
        yield "doctor", screen.words()[1:]


async def _run_and_submit(app: BenchbotApp, pilot: Pilot[None], more: Mapping[str, str]) -> Words:
    form = SolutionForm(none=None)
    await app.screen.mount(form)
    form.query_one("#command", Input).value = "python mine.py"
    form.query_one("#more", Input).value = more["run"]
    yield "run", [*run_words(RUN), *form.more][1:]
    form.query_one("#more", Input).value = more["submit"]
    options = form.options("e:1")
    assert options is not None
    yield "submit", submit_words(options, RUN)[1:]


async def _opened(app: BenchbotApp, pilot: Pilot[None], screen: S) -> S:
    await app.push_screen(screen)
    await pilot.pause()
    return screen


def _fill(screen: Screen[None]) -> None:
    """Type something into each field."""
    for field in screen.query(TextField):
        field.value = field.value or "1"


def _commands() -> Iterator[tuple[str, Any]]:
    records = [*EVERYDAY, *(provided.value for provided in plugin_manager.load().pool("commands").values())]
    for record in records:
        if record.name in FIELDS:
            command = Stub(record).load()
            yield record.name, command.commands["run"] if record.name == "batch" else command


def _offered(command: Any) -> list[Any]:
    """Return the options that can be given; `NOWHERE` names the others."""
    options = [each for each in command.params if each.param_type_name == "option" and not each.hidden]
    return [option for option in options if not option.opts[0].startswith(tuple(NOWHERE))]


def _typed(command: Any) -> list[str]:
    """Return every option as one types it."""
    return [option.opts[0] if option.is_flag else f"{option.opts[0]}=1" for option in _offered(command)]


def _given(command: Any, words: Sequence[str]) -> list[str]:
    """Return the options among the words of a command, which must know each."""
    with Context(command, resilient_parsing=True) as context:
        _, _, order = command.make_parser(context).parse_args(list(words))
    return [parameter.opts[0] for parameter in order]
