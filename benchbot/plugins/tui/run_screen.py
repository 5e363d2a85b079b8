"""The screen that watches a run: what the robot sees, where it is, how it gets on; and the keys of its host."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.content import Content
from textual.screen import Screen
from textual.widgets import Footer

from benchbot.plugins.tui import snapshot
from benchbot.plugins.tui.map_panel import ZOOMS, MapPanel, Scenery, Surroundings, environment_of_run, map_of_run
from benchbot.plugins.tui.question import Question
from benchbot.plugins.tui.watching import panels, picture_boxes, run_facts, run_keys
from benchbot.plugins.tui.watching.asking import AskText
from benchbot.plugins.tui.watching.camera import Camera, Channel, available
from benchbot.plugins.tui.watching.commands import Commands
from benchbot.plugins.tui.watching.feeds import RunFeed, leave
from benchbot.plugins.tui.watching.log_view import LogView
from benchbot.plugins.tui.watching.panels import Words
from benchbot.plugins.tui.watching.teleop import Wheel
from benchbot.plugins.watching.views import RunView
from benchbot.wire.run_state import RunState

PERIOD_S = 0.1
LEAST_WIDTH_PX, MOST_WIDE_PX = 160, 1280
DRIVING = "Driving"
ASKS = "THE ROBOT ASKS YOU\n\n{}\n\nWhen it is done, press y. Mind that the robot may move then."
BY_HAND = (
    "Drive the robot by hand?\n\n"
    "The solution is held meanwhile. Each step by hand counts, and is marked as such in the result."
)


class RunScreen(Screen[None]):
    """Watches a run until its user leaves; it closes its feed then, which does the run no harm.

    `again` starts a run of the same selection, `report` opens that of a result: keys for what is None are not there.
    `images` is `halfcell`, `kitty`, `sixel` or `none`; snapshots go to `snapshots`, by default a folder beneath the
    current one.
    """

    CSS_PATH = "watching/run_screen.tcss"
    HORIZONTAL_BREAKPOINTS = run_keys.COLUMNS
    VERTICAL_BREAKPOINTS = run_keys.LINES
    BINDINGS: ClassVar[list[BindingType]] = run_keys.BINDINGS

    def __init__(
        self,
        feed: RunFeed,
        *,
        again: Callable[[RunState], None] | None = None,
        report: Callable[[Path], None] | None = None,
        surroundings: Surroundings | None = None,
        images: str = "halfcell",
        snapshots: Path | None = None,
    ) -> None:
        super().__init__()
        self.feed = feed
        self._again = again
        self._report = report
        self._scenery = Scenery(surroundings)
        self._images = images
        self._snapshots = snapshots or snapshot.DEFAULT_FOLDER
        self._commands = Commands()
        self._view: RunView | None = None
        self._by_hand = False
        self._wheel = Wheel()
        self._channel = 0
        self._zoom = 0
        self._truth = False
        self._asked: tuple[tuple[str, ...], int] = ((), 0)
        self._keys: object = None
        self._fetched = 0
        self._cameras = [Camera(picture_boxes.make(images), id=f"camera-{number}") for number in (1, 2)]
        self._map = MapPanel(picture_boxes.make(images), id="map")
        self._log = LogView()
        self._words = {
            name: Words(id=name)
            for name in ("headline", "hand", "operator", "problem", "where", "last", "use", "limits", "compact")
        }

    def compose(self) -> ComposeResult:
        """Lay out everything; which parts of it are shown is for the size to say."""
        words = self._words
        yield words["headline"]
        yield words["hand"]
        yield words["operator"]
        yield words["problem"]
        with Horizontal(id="pictures"):
            yield from self._cameras
            yield self._map
        with Horizontal(id="facts"):
            for title, names in (
                ("Run", ["where"]),
                ("Last action", ["last"]),
                ("Time and load", ["use"]),
                ("Limits", ["limits"]),
            ):
                with Vertical(classes="panel") as panel:
                    panel.border_title = title
                    yield from (words[name] for name in names)
        yield words["compact"]
        with Vertical(id="log") as frame:
            frame.border_title = "Log"
            yield self._log
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Look at the feed from now on."""
        self._tick()
        self.set_interval(PERIOD_S, self._tick)

    def on_unmount(self) -> None:
        """Leave the run to itself."""
        leave(self.feed)

    def on_resize(self) -> None:
        """Lay out the facts for the new size."""
        self.call_after_refresh(self._show_all)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Say which keys mean something now."""
        view = self._view
        alive = view is not None and view.alive
        driving = self._by_hand and alive
        match action:
            case "pause":
                return alive and not driving
            case "single_step":
                return alive and not driving and view is not None and view.paused
            case "drive":
                return driving and (parameters != ("next",) or run_facts.follows_trajectory(view))
            case "resize":
                return driving
            case "by_hand" | "stop":
                return alive
            case "confirm":
                return alive and view is not None and bool(view.progress.get("waiting_for"))
            case "again":
                return self._again is not None
            case "report":
                return self._report is not None and view is not None and view.result is not None
            case _:
                return True

    # What is shown

    def _tick(self) -> None:
        for outcome in self._commands.ended():
            if outcome.error is not None:
                error = outcome.error
                self.notify(f"{error.why}\n{error.fix}", title=error.title, severity="error", timeout=10, markup=False)
            elif outcome.done is not None:
                outcome.done(outcome.value)
            self._show_all()
        if self.feed.view is not self._view or self._scenery.fetched != self._fetched:
            self._show_all()

    def _show_all(self) -> None:
        view = self._view = self.feed.view
        self._fetched = self._scenery.fetched
        if not self.is_mounted:
            return
        if not view.alive:
            self._by_hand = False
        self._show_words(view)
        self._show_pictures(view)
        self._log.show(view.log, view.log_dropped)
        keys = (view.alive, view.paused, self._by_hand, bool(view.progress.get("waiting_for")), view.result)
        if keys != self._keys:
            self._keys = keys
            self.refresh_bindings()

    def _show_words(self, view: RunView) -> None:
        words, width = self._words, self.size.width
        badge = run_facts.badge(view, by_hand=self._by_hand)
        words["headline"].tell(panels.headline(badge, self._commands.under_way, run_facts.title(view)))
        words["hand"].display = self._by_hand
        words["hand"].tell(f"BY HAND: w a s d or arrows move {self._wheel}   , smaller   . larger   h ends it")
        request = view.progress.get("waiting_for") if view.alive else None
        words["operator"].display = bool(request)
        words["operator"].tell(ASKS.format(request) if request else "")
        problem = run_facts.problem(view)
        words["problem"].display = bool(problem)
        words["problem"].tell(problem)
        words["problem"].set_class(run_facts.is_bad(view), "-bad")
        words["where"].tell(panels.rows(run_facts.where(view)))
        words["last"].tell(panels.rows(run_facts.last_step(view.last)))
        words["use"].tell(panels.rows(run_facts.time_and_use(view)))
        gauges = run_facts.gauges(view)
        words["limits"].tell(panels.bars(gauges, min(width // 4 - 4, 60)))
        lines = [Content(line) for line in run_facts.compact(view)]
        lines.append(
            Content("  ").join(
                Content.assemble((f"{each.name} ", panels.MUTED), panels.bar(each.share, 8), f" {each}")
                for each in gauges[:3]
            )
        )
        words["compact"].tell(Content("\n").join(lines))

    def _show_pictures(self, view: RunView) -> None:
        channels = available(view.session.get("observations") or ())
        shown = self._shown_channels(channels)
        for place, camera in enumerate(self._cameras):
            if place < len(shown) or (place == 0 and view.session):
                camera.show(view.look, shown[place] if place < len(shown) else None)
            camera.display = place == 0 or place < len(shown)
        self._look_at(view, shown)
        run_map, key = map_of_run(view, self._scenery, self._zoom, truth=self._truth)
        self._map.show(run_map, key)

    def _shown_channels(self, channels: list[Channel]) -> list[Channel]:
        if not channels:
            return []
        count = min(len(channels), 2 if self.has_class("-huge") else 1)
        return [channels[(self._channel + place) % len(channels)] for place in range(count)]

    def _look_at(self, view: RunView, shown: list[Channel]) -> None:
        """Have the feed fetch what is shown, no finer than it can be shown."""
        if not view.session:
            return
        beside = ["laser", "poses"]
        if self._images != "none" and any(channel.name == "image_segment" for channel in shown):
            beside.append("image_rgb")  # it shines through
        offered = view.session.get("observations", ())
        seen = [] if self._images == "none" else [channel.name for channel in shown]
        names = list(dict.fromkeys([*seen, *(name for name in beside if name in offered)]))
        # Twice as many pixels as columns: their mean is smoother than every n-th pixel.
        width = min(max(2 * self._cameras[0].pixels_wide, LEAST_WIDTH_PX), MOST_WIDE_PX)
        if (tuple(names), width) != self._asked:
            self._asked = (tuple(names), width)
            self.feed.choose(names, width)

    # What keys do

    def action_pause(self) -> None:
        """Hold the solution's next step, or let it go on."""
        if self.feed.view.paused:
            self._command("Going on", self.feed.go_on)
        else:
            self._command("Pausing", self.feed.pause)

    def action_single_step(self) -> None:
        """Let one step of the solution through."""
        self._command("One step", self.feed.single_step)

    def action_by_hand(self) -> None:
        """Begin to drive by hand, or end it."""
        if self._by_hand:
            self._by_hand = False
            self._show_all()
            return
        self.app.push_screen(Question(BY_HAND, {"h": "drive by hand"}), self._begin_by_hand)

    def _begin_by_hand(self, answer: str | None) -> None:
        if answer is None:
            return
        started = bool(self.feed.view.session.get("started", True))
        if started and not self.feed.view.paused:
            self._command("Pausing", self.feed.pause, lambda _: self._drive_from_now())
        else:
            self._drive_from_now()

    def _drive_from_now(self) -> None:
        self._by_hand = True
        self._show_all()

    def action_drive(self, where: str) -> None:
        """Take a step by hand, unless the last one is still under way."""
        action, arguments = self._wheel.order(where)
        self._command(DRIVING, partial(self.feed.drive, action, arguments))

    def action_resize(self, change: int) -> None:
        """Make steps by hand smaller or larger."""
        self._wheel = self._wheel.resized(change)
        self._show_all()

    def action_confirm(self) -> None:
        """Say that what the robot's operator was asked is done."""
        self._command(
            "Confirming", self.feed.confirm, lambda request: self.notify(f"Confirmed: {request}", markup=False)
        )

    def action_stop(self) -> None:
        """End the run, or only stop watching: ask which. The same key again ends it, for who must be quick."""
        text = "End this run?\n\nThe robot stops where it is, and the solution's episode is over."
        answers = {"x": "end the run now", "w": "only stop watching: the run goes on"}
        self.app.push_screen(Question(text, answers), self._stop_as)

    def _stop_as(self, answer: str | None) -> None:
        if answer == "x":
            self._command("Ending the run", self.feed.stop)
        elif answer == "w":
            self.action_leave()

    def action_again(self) -> None:
        """Start a run of the same selection; one that still runs is ended first."""
        if not self.feed.view.alive:
            self._start_again()
            return
        text = "End this run, and start it again from the beginning?"
        self.app.push_screen(Question(text, {"r": "end it and start again"}), self._again_as)

    def _again_as(self, answer: str | None) -> None:
        if answer is not None:
            self._command("Ending the run", self.feed.stop, lambda _: self._start_again())

    def _start_again(self) -> None:
        if self._again is not None:
            self._again(self.feed.view.state)

    def action_report(self) -> None:
        """Open the report of the result."""
        result = self.feed.view.result
        if self._report is not None and result is not None:
            self._report(result)

    def action_channel(self) -> None:
        """Show the next channel of the camera."""
        self._channel += 1
        self._show_all()

    def action_truth(self) -> None:
        """Show what is really there on the map, or hide it."""
        self._truth = not self._truth
        if self._truth and not self._scenery.surroundings(environment_of_run(self.feed.view)).objects:
            self.notify("No ground truth of this place is installed.")
        self._show_all()

    def action_zoom(self, change: int) -> None:
        """Show less of the map, but larger; or more of it."""
        self._zoom = min(max(self._zoom + change, 0), len(ZOOMS) - 1)
        self._show_all()

    def action_whole_map(self) -> None:
        """Show all of the map."""
        self._zoom = 0
        self._show_all()

    def action_snapshot(self) -> None:
        """Write what is shown as PNG files, and tell where."""
        view = self.feed.view
        run_map, _ = map_of_run(view, self._scenery, self._zoom, truth=self._truth)
        take = partial(snapshot.take, view, run_map, self._snapshots)
        self._command(
            "Writing",
            take,
            lambda paths: self.notify("\n".join(map(str, paths)), title="Written", timeout=10, markup=False),
        )

    def action_log_level(self) -> None:
        """Show the log from another level on."""
        self._log.choose(self._log.filter.next_level())

    def action_log_source(self) -> None:
        """Show the log of the next source."""
        self._log.choose(self._log.filter.next_source(self._log.sources))

    def action_log_text(self) -> None:
        """Show only the lines of the log that hold a text."""
        self.app.push_screen(AskText("Lines of the log with", self._log.filter.text), self._find)

    def _find(self, text: str | None) -> None:
        if text is not None:
            self._log.choose(self._log.filter.with_text(text))

    def action_log_scroll(self, where: str) -> None:
        """Scroll the log."""
        self._log.scroll(where)

    def action_leave(self) -> None:
        """Stop driving by hand; or stop watching: the run goes on."""
        if self._by_hand:
            self.action_by_hand()
        else:
            self.dismiss(None)

    def _tell(self, title: str, text: str) -> None:
        self.notify(text, title=title, timeout=10, markup=False)

    def _command(self, what: str, call: Callable[[], Any], done: Callable[[Any], None] | None = None) -> None:
        # A step by hand may wait for the operator, or have to be ended: nothing else waits for it.
        if self._commands.begin(what, call, done, beside=what != DRIVING):
            self._show_all()
