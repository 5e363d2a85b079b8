"""The screen that adds seeds to a batch: how many episodes that makes, a check of it, and the start."""

from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import Input

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.extension import next_seeds, shown
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import Plan
from benchbot.plugins.batch.request import numbers
from benchbot.plugins.screens.child_command import Outcome
from benchbot.plugins.screens.command_screen import CommandScreen
from benchbot.plugins.screens.widgets import Facts, TextField

WHEN_RUNNING = "Workers that run are ended and begun anew; what they compute just now is begun again."
STATISTICS = (
    "Whoever adds seeds because of what the results so far look like finds differences by chance: intervals and "
    "p-values hold for a number that was fixed before. Scores and comparison will say that seeds were added."
)


class AddSeedsScreen(CommandScreen):
    """Adds seeds to the batch in a folder, which then goes on as a detached one."""

    HEADING = "Add seeds to a batch"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+t", "check", "Check", tooltip="See what would be computed; start nothing"),
        Binding("ctrl+s", "start", "Start", tooltip="Add the seeds, and compute them"),
    ]

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder
        self._plan: Plan | None = None
        self._seeds_field = TextField("Seeds to add", placeholder="3..5 or 7,9")
        self._workers_field = TextField("Workers", placeholder="as many as before")
        self._facts = Facts()

    def body(self) -> ComposeResult:
        """Yield the form, and what comes of it."""
        with VerticalScroll(classes="form", can_focus=False):
            yield self._seeds_field
            yield self._workers_field
            yield self._facts

    def on_mount(self) -> None:
        """Read the plan in a thread: that of ten thousand episodes takes a while."""
        super().on_mount()
        self._seeds_field.focus_input()
        self.app.in_thread(lambda: plans.read(Folder(self._folder).plan), self._take)

    def words(self) -> list[str]:
        """Return the command; raises BenchbotError while no seeds are named."""
        numbers("--seeds", self._seeds_field.value or " ")
        jobs = [f"--jobs={self._workers_field.value}"] if self._workers_field.value else []
        return ["batch", "extend", str(self._folder), f"--seeds={self._seeds_field.value}", *jobs]

    def on_input_changed(self) -> None:
        """Show the command and the size as they are now."""
        super().on_input_changed()
        self._show_size()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Go on to the next field."""
        self.focus_next()

    def action_check(self) -> None:
        """See what would be computed."""
        self.run_words(["--dry-run", "--json"], self._checked, doing="Checking", only_looks=True)

    def action_start(self) -> None:
        """Add the seeds and go on with the batch."""
        self.run_words(["--detach", "--json"], self._started, doing="Adding the seeds")

    def _checked(self, outcome: Outcome) -> None:
        episodes = outcome.document["episodes"]
        done = sum(episode["done"] for episode in episodes)
        self.say(f"✓ Nothing is in the way: {len(episodes)} episodes, {done} of them done.", "green")

    def _started(self, _: Outcome) -> None:
        self.dismiss(None)

    def _take(self, plan: Plan) -> None:
        if self.is_attached:
            self._plan = plan
            if not self._seeds_field.value:
                self._seeds_field.value = next_seeds(plan)
            self._show_size()

    def _show_size(self) -> None:
        plan = self._plan
        if plan is None:
            return
        before = list(dict.fromkeys(each.seed for each in plan.episodes))
        each = len(plan.episodes) // len(before)
        try:
            added = [seed for seed in numbers("--seeds", self._seeds_field.value or " ") if seed not in before]
            total = len(plan.episodes) + len(added) * each
            noun = "seed" if len(added) == 1 else "seeds"
            size = f"{len(plan.episodes)} episodes + {len(added)} {noun} × {each} = {total} episodes"
        except BenchbotError as error:
            size = f"{error.title} {error.why}"
        self._facts.tell(
            {
                "Batch": self._folder,
                "Its seeds": shown(before),
                "With those to add": size,
                "While it runs": WHEN_RUNNING,
                "Statistics": STATISTICS,
            }
        )
