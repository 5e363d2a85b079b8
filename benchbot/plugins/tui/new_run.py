"""The screen that starts a run: choose the task, the robot, the environment, then seed, limits and a solution."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np
from PIL.Image import Image
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.screen import Screen
from textual.widgets import Button, ContentSwitcher, Footer, Input, OptionList, Static, Tab, Tabs
from textual.widgets.option_list import Option

from benchbot.core.declarations.catalog import Declaration
from benchbot.core.errors import BenchbotError
from benchbot.plugins.screens.command_screen import COPY, CommandLine
from benchbot.plugins.tui.base import BaseApp
from benchbot.plugins.tui.choices import Choice, Possibilities, facts
from benchbot.plugins.tui.forms import RunForm, SolutionForm, offers_of, run_words, submit_words
from benchbot.plugins.tui.previews import preview
from benchbot.plugins.tui.raster import Picture, Raster

STEPS = {"task": "Task", "robot": "Robot", "environment": "Environment", "start": "Start"}
CHOSEN = ("task", "robot", "environment")


class NewRunScreen(Screen[None]):
    """Four steps. Impossible choices are listed with their reasons."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "back", "Back", tooltip="Back to the step before, or to what is alive"),
        Binding("slash", "filter", "Find", key_display="/", tooltip="Show only names with these letters"),
        *(
            Binding(str(number), f"step('{step}')", title, show=False, tooltip=f"Go to the step '{title}'")
            for number, (step, title) in enumerate(STEPS.items(), 1)
        ),
        Binding("ctrl+s", "start", "Start", tooltip="Start what is chosen"),
        COPY,
    ]
    app: BaseApp

    def __init__(self) -> None:
        super().__init__()
        self.chosen: dict[str, str] = {}
        self._choices: dict[str, dict[str, Choice]] = {}
        self._possibilities: Possibilities | None = None

    def compose(self) -> ComposeResult:
        """Show the steps, still empty."""
        yield Static("New run", classes="bar")
        yield Tabs(*(Tab(title, id=step) for step, title in STEPS.items()))
        with Horizontal(classes="pane"):
            with ContentSwitcher(initial="pane-task", classes="pane"):
                for step in CHOSEN:
                    with VerticalScroll(id=f"pane-{step}", can_focus=False):
                        yield Input(placeholder="letters of the name", classes="filter", id=f"filter-{step}")
                        yield OptionList(id=f"list-{step}", classes="list", markup=False)
                with VerticalScroll(id="pane-start", classes="form", can_focus=False):
                    yield Static(id="summary", markup=False)
                    yield RunForm()
                    yield SolutionForm(none="none yet: wait for one")
                    yield Button("Start", variant="primary", id="go", compact=True)
            with VerticalScroll(classes="details", can_focus=False):
                yield Raster(id="picture")
                yield Static(id="facts", markup=False)
        yield CommandLine()
        yield Footer()

    def on_mount(self) -> None:
        """Read the catalog in a thread."""
        self.query_one("#list-task", OptionList).loading = True

        def read() -> list[Choice]:
            self._possibilities = Possibilities(self.app.catalog)
            return self._possibilities.tasks()

        self.app.in_thread(read, lambda choices: self._offer("task", choices))

    @property
    def step(self) -> str:
        """The step that is shown."""
        return str(self.query_one(Tabs).active or "task")

    def action_step(self, step: str) -> None:
        """Go to a step, if those before it are done."""
        missing = [before for before in CHOSEN[: list(STEPS).index(step)] if before not in self.chosen]
        if missing:
            self.notify(f"First choose the {missing[0]}.", timeout=3)
            step = missing[0]
        self.query_one(Tabs).active = step

    def action_back(self) -> None:
        """Go to the step before, or leave."""
        before = list(STEPS)[: list(STEPS).index(self.step)]
        if self.step in CHOSEN and self.query_one(f"#filter-{self.step}").display:
            self._filter(on=False)
        elif before:
            self.query_one(Tabs).active = before[-1]
        else:
            self.app.pop_screen()

    def action_filter(self) -> None:
        """Ask for letters."""
        if self.step in CHOSEN:
            self._filter(on=True)

    def action_start(self) -> None:
        """Start what is chosen; the screens can end, it goes on."""
        if len(self.chosen) < len(CHOSEN):
            self.action_step("start")
            return
        try:
            words, result = self._command()
        except BenchbotError as error:
            self.app.tell(error)
            return
        self.app.pop_screen()
        self.app.start(words, result, watch=True)

    def action_copy(self) -> None:
        """Copy the command line."""
        self.query_one(CommandLine).copy()

    def _command(self) -> tuple[list[str], Path | None]:
        """Return the command that starts what is chosen, and the file of its result; raises BenchbotError."""
        run = self.query_one(RunForm).request(*(self.chosen[step] for step in CHOSEN))
        form = self.query_one(SolutionForm)
        solution = form.options(run.environment)
        if solution is None:
            return [*run_words(run), *form.more], None
        return submit_words(solution, run), solution.result

    def _show_command(self) -> None:
        line = self.query_one(CommandLine)
        line.display = self.step not in CHOSEN
        if line.display:
            line.tell(lambda: self._command()[0])

    def on_button_pressed(self) -> None:
        """Start."""
        self.action_start()

    def on_tabs_tab_activated(self, event: Tabs.TabActivated) -> None:
        """Show the step of a tab, if those before it are done."""
        step = str(event.tab.id)
        if any(before not in self.chosen for before in CHOSEN[: list(STEPS).index(step)]):
            self.action_step(step)
            return
        self.query_one(ContentSwitcher).current = f"pane-{step}"
        self._show_command()
        if step in CHOSEN:
            self.query_one(f"#list-{step}").focus()
            self._tell(self._marked(step))
        else:
            self.query_one("#summary", Static).update("  ".join(self.chosen[each] for each in CHOSEN))
            self.query_one("#solution").focus()
            self._tell(self.chosen["environment"], "environment")

    def on_input_changed(self, event: Input.Changed) -> None:
        """Show what fits the letters, or the command as it is now."""
        if event.input.has_class("filter"):
            self._show(self.step)
        else:
            self._show_command()

    def on_select_changed(self) -> None:
        """Show the command as it is now."""
        self._show_command()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Choose the first that fits the letters, or look for an environment of a set of such a name."""
        if event.input.has_class("filter"):
            options = self.query_one(f"#list-{self.step}", OptionList)
            if self.step == "environment" and self._marked(self.step) is None:
                self._look_up_by_name(event.value.strip())
                return
            options.focus()
            options.action_select()

    def on_option_list_option_highlighted(self, event: OptionList.OptionHighlighted) -> None:
        """Tell more of what is marked."""
        if event.option_list.id == f"list-{self.step}":
            self._tell(event.option_id)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Choose it and go on, or say why that is not possible."""
        step = self.step
        # With keys typed ahead, Enter may come from the list of the step before.
        if event.option_list.id != f"list-{step}" or event.option_id is None:
            return
        choice = self._choices[step][event.option_id]
        if choice.reasons:
            for reason in choice.reasons:
                self.app.tell(reason)
            return
        if self.chosen.get(step) != choice.name:
            self._forget_after(step)
        self.chosen[step] = choice.name
        following = list(STEPS)[list(STEPS).index(step) + 1]
        self.query_one(f"#{step}", Tab).label = f"{STEPS[step]}: {_short(choice.name)}"
        if following in CHOSEN and following not in self._choices:
            self._look_up(following)
        self.query_one(Tabs).active = following

    def _look_up(self, step: str) -> None:
        found = self._possibilities
        if found is None:
            return
        task, robot = self.chosen["task"], self.chosen.get("robot", "")
        ask: dict[str, Callable[[], list[Choice]]] = {
            "robot": lambda: found.robots(task),
            "environment": lambda: found.environments(task, robot),
        }
        self.query_one(f"#list-{step}", OptionList).loading = True
        self.app.in_thread(ask[step], lambda choices: self._offer(step, choices))
        if step == "robot":
            self.app.in_thread(lambda: offers_of(found.catalog, task), self.query_one(SolutionForm).offer)

    def _look_up_by_name(self, name: str) -> None:
        """List an environment of a set, which is made now; say that there is none of the name."""
        found, task, robot = self._possibilities, self.chosen["task"], self.chosen["robot"]
        if found is None:
            return
        full_name = name if ":" in name else f"{name}:1"

        def ask() -> Choice:
            found.catalog.environments(full_name)
            return Choice(full_name, found.against(task, robot, full_name))

        def offer(choice: Choice) -> None:
            self._offer("environment", [*self._choices.get("environment", {}).values(), choice])

        options = self.query_one("#list-environment", OptionList)
        options.loading = True
        self.app.in_thread(ask, offer, partial(setattr, options, "loading", False))

    def _forget_after(self, step: str) -> None:
        for later in CHOSEN[CHOSEN.index(step) + 1 :]:
            self.chosen.pop(later, None)
            self._choices.pop(later, None)
            self.query_one(f"#{later}", Tab).label = STEPS[later]

    def _offer(self, step: str, choices: list[Choice]) -> None:
        if not self.is_attached:
            return
        self._choices[step] = {choice.name: choice for choice in choices}
        options = self.query_one(f"#list-{step}", OptionList)
        options.loading = False
        self._show(step)
        if self.step == step:
            options.focus()

    def _show(self, step: str) -> None:
        """List what fits the letters, the possible ones first."""
        options = self.query_one(f"#list-{step}", OptionList)
        letters = self.query_one(f"#filter-{step}", Input).value.lower()
        fitting = [choice for choice in self._choices.get(step, {}).values() if letters in choice.name.lower()]
        ordered = sorted(fitting, key=lambda choice: bool(choice.reasons))
        options.set_options([Option(_prompt(choice), id=choice.name) for choice in ordered])
        if step == "environment" and self._possibilities is not None:
            for names in self._possibilities.catalog.made_environments:
                options.add_option(Option(f"  {names}: / and its name", disabled=True))
        if ordered:
            options.highlighted = 0

    def _filter(self, *, on: bool) -> None:
        letters = self.query_one(f"#filter-{self.step}", Input)
        # At once, so that keys typed ahead already go into the field.
        letters.display = on
        if on:
            self.set_focus(letters)
        else:
            letters.value = ""
            self.query_one(f"#list-{self.step}").focus()

    def _marked(self, step: str) -> str | None:
        option = self.query_one(f"#list-{step}", OptionList).highlighted_option
        return None if option is None else option.id

    def _tell(self, name: str | None, step: str | None = None) -> None:
        """Show picture, reasons and facts of the marked choice; they are made in a thread."""
        step = step or self.step
        found = self._possibilities
        choice = self._choices.get(step, {}).get(name or "")
        if found is None or name is None or choice is None:
            self._told(None, "")
            return

        def make() -> tuple[Image | None, str]:
            declarations = _declarations(found, step, name)
            reasons = [f"✗ {reason.title}\n{reason.why}\n→ {reason.fix}" for reason in choice.reasons]
            text = "\n\n".join([*reasons, *(_fact_lines(each) for each in declarations)])
            return (preview(declarations[0]) if declarations else None), text

        def show(made: tuple[Image | None, str]) -> None:
            if self.is_attached and (self.step not in CHOSEN or name == self._marked(self.step)):
                self._told(*made)

        self.app.in_thread(make, show)

    def _told(self, picture: Image | None, text: str) -> None:
        raster = self.query_one(Raster)
        raster.show(None if picture is None else Picture(np.asarray(picture)))
        raster.display = picture is not None
        self.query_one("#facts", Static).update(text)


def _declarations(found: Possibilities, step: str, name: str) -> list[Declaration]:
    try:
        return found.catalog.environments(name) if step == "environment" else [found.catalog.get(f"{step}s", name)]
    except BenchbotError:
        return []


def _fact_lines(declaration: Declaration) -> str:
    return "\n".join(f"{label}: {value}" if label else value for label, value in facts(declaration) if value)


def _prompt(choice: Choice) -> Text:
    if not choice.reasons:
        return Text(f"  {choice.name}")
    # There is room for one line: the reason says more than the title.
    return Text(f"✗ {choice.name}\n  {' '.join(choice.reasons[0].why.split())}", style="dim")


def _short(name: str) -> str:
    return name if len(name) <= 16 else f"…{name[-15:]}"
