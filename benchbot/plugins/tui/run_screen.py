"""The screen that watches a run: camera, map, status and log; and the keys of its host."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Footer

from benchbot.plugins.tui import panels, raster, result_rows, run_facts, snapshot
from benchbot.plugins.tui.base import WatchScreen
from benchbot.plugins.tui.camera import CameraPanel, Channel, available
from benchbot.plugins.tui.dialogs import AskText
from benchbot.plugins.tui.log_view import LogView
from benchbot.plugins.tui.map_panel import ZOOMS, MapPanel, Scenery, Surroundings, environment_of_run, map_of_run
from benchbot.plugins.tui.teleop import Teleop
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.plugins.watching.views import RunView
from benchbot.wire.run_state import RunState

LEAST_WIDTH_PX, MOST_WIDE_PX = 160, 1280
DRIVING = "Driving"
COLUMNS = [(0, "-tiny"), (12, "-narrow"), (50, "-medium"), (100, "-wide"), (160, "-huge")]
LINES = [(0, "-flat"), (14, "-short"), (32, "-tall")]
"""The class of the screen from so many columns or lines on: run_screen.tcss says what it shows then."""
WORDS = ("headline", "hand", "operator", "problem", "where", "use", "compact")
FACTS = {"Run": "where", "Lately": "use"}
SCORE_PERIOD_S = 1.0
LEAST_LOG_LINES, MOST_LOG_LINES = 5, 12
ASKS = "THE ROBOT ASKS YOU\n\n{}\n\nWhen it is done, press y. Mind that the robot may move then."
BY_HAND = (
    "Drive the robot by hand?\n\n"
    "The solution is held meanwhile. Each step by hand counts, and is marked as such in the result."
)


class RunScreen(WatchScreen):
    """Watches a run; leaving it does the run no harm.

    `again` starts a run of the same selection, `report` opens that of a result: keys for what is None are not there.
    `images` is `halfcell`, `kitty`, `sixel` or `none`; snapshots go to `snapshots`, by default a folder in the
    working folder.
    """

    PERIOD_S = 0.1
    CSS_PATH = "run_screen.tcss"
    HORIZONTAL_BREAKPOINTS = COLUMNS
    VERTICAL_BREAKPOINTS = LINES
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "pause", "Pause", key_display="space"),
        Binding("1", "single_step", "One step"),
        Binding("d", "by_hand", "Drive", tooltip="Drive by hand; it asks first, and esc ends it"),
        Binding("up,w,k", "drive('forward')", "Forwards", show=False),
        Binding("down,s,j", "drive('back')", "Back", show=False),
        Binding("left,a,h", "drive('left')", "Left", show=False),
        Binding("right,d,l", "drive('right')", "Right", show=False),
        Binding("enter", "drive('next')", "Next pose", key_display="enter"),
        Binding("comma", "resize(-1)", "Smaller steps by hand", show=False, key_display=","),
        Binding("full_stop", "resize(1)", "Larger steps by hand", show=False, key_display="."),
        Binding("y", "confirm", "It is done"),
        Binding("x", "stop", "Stop"),
        Binding("r", "again", "Again"),
        Binding("o", "report", "Report"),
        Binding("c", "channel", "Camera"),
        Binding("t", "truth", "Truth"),
        Binding("plus,equals_sign", "zoom(1)", "Zoom in", show=False, key_display="+"),
        Binding("minus", "zoom(-1)", "Zoom out", show=False, key_display="-"),
        Binding("0", f"zoom(-{len(ZOOMS)})", "Whole map", show=False),
        Binding("p", "snapshot", "Picture"),
        Binding("L", "log_level", "Log level", show=False),
        Binding("v", "log_source", "Log source", show=False),
        Binding("slash", "log_text", "Find in log", show=False, key_display="/"),
        Binding("up,k", "log_scroll('up')", "One log line back", show=False),
        Binding("down,j", "log_scroll('down')", "One log line on", show=False),
        Binding("pageup", "log_scroll('page_up')", "Older log lines", show=False),
        Binding("pagedown", "log_scroll('page_down')", "Newer log lines", show=False),
        Binding("home", "log_scroll('home')", "Oldest log line", show=False),
        Binding("end", "log_scroll('end')", "Newest log lines", show=False),
        Binding("escape,q", "leave", "Leave", key_display="esc"),
    ]
    feed: RunFeed

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
        super().__init__(feed, WORDS)
        self._again = again
        self._report = report
        self._scenery = Scenery(surroundings)
        self._images = images
        self._snapshots = snapshots or snapshot.DEFAULT_FOLDER
        self._view: RunView | None = None
        self._by_hand = False
        self._teleop = Teleop()
        self._channel = 0
        self._zoom = 0
        self._truth = False
        self._requested: tuple[tuple[str, ...], int] = ((), 0)
        self._fetched = 0
        self._cameras = [CameraPanel(raster.make(images), id=f"camera-{number}") for number in (1, 2)]
        self._map = MapPanel(raster.make(images), id="map")
        self._log = LogView()
        self._score = ""

    def compose(self) -> ComposeResult:
        """Lay out everything; the size of the terminal decides which parts are shown."""
        words = self._words
        yield from (words[name] for name in ("headline", "hand", "operator", "problem"))
        with Horizontal(id="pictures"):
            yield self._cameras[0]
            with Vertical(id="beside"):
                yield self._cameras[1]
                yield self._map
        with Horizontal(id="facts"):
            for title, name in FACTS.items():
                with Vertical(classes="panel", id=f"panel-{name}") as panel:
                    panel.border_title = title
                    yield words[name]
        yield words["compact"]
        with Vertical(id="log") as frame:
            frame.border_title = "Log"
            yield self._log
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Follow the run, and look for its score when it has a result."""
        super().on_mount()
        self.set_interval(SCORE_PERIOD_S, self._look_for_score)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Say which keys mean something now."""
        view, driving = self.feed.view, self._by_hand
        match action:
            case "pause":
                return view.alive and not driving
            case "single_step":
                return view.alive and not driving and view.paused
            case "drive":
                return view.alive and driving and (parameters != ("next",) or run_facts.follows_trajectory(view))
            case "by_hand":
                return view.alive and not driving
            case "log_scroll":
                return not (driving and parameters[0] in ("up", "down"))
            case "resize":
                return view.alive and driving
            case "stop":
                return view.alive
            case "confirm":
                return view.alive and bool(view.progress.get("waiting_for"))
            case "again":
                return self._again is not None
            case "report":
                return self._report is not None and view.result is not None
            case _:
                return True

    # What is shown

    def _has_news(self) -> bool:
        return self.feed.view is not self._view or self._scenery.fetched != self._fetched

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
        # A fifth of the screen at most: the rest is for the pictures.
        most = max(LEAST_LOG_LINES, min(MOST_LOG_LINES, self.size.height // 5))
        lines = min(max(self._log.count, LEAST_LOG_LINES), most)
        self.query_one("#log").styles.height = lines + 2
        self._show_keys((view.alive, view.paused, self._by_hand, bool(view.progress.get("waiting_for")), view.result))

    def _show_words(self, view: RunView) -> None:
        words, width = self._words, self.size.width
        badge = run_facts.badge(view, by_hand=self._by_hand)
        words["headline"].tell(panels.headline(badge, self._under_way, run_facts.title(view)))
        words["hand"].display = self._by_hand
        words["hand"].tell(f"BY HAND: w a s d or arrows move {self._teleop}   , smaller   . larger   esc ends it")
        request = view.progress.get("waiting_for") if view.alive else None
        words["operator"].display = bool(request)
        words["operator"].tell(ASKS.format(request) if request else "")
        problem = run_facts.problem(view)
        words["problem"].display = bool(problem)
        words["problem"].tell(problem)
        words["problem"].set_class(run_facts.is_bad(view), "-bad")
        facts = run_facts.columns(view, self._score, width // len(FACTS) - 4)
        for name, content in facts.items():
            words[name].tell(content)
            self.query_one(f"#panel-{name}").display = bool(content)
        height = max(content.plain.count("\n") + 1 for content in facts.values())
        self.query_one("#facts").styles.height = height + 2
        words["compact"].tell(run_facts.brief(view, self._score))

    def _show_pictures(self, view: RunView) -> None:
        channels = available(view.session.get("observations") or ())
        count = min(len(channels), 2 if self.has_class("-huge") else 1)
        shown = [channels[(self._channel + place) % len(channels)] for place in range(count)]
        for place, camera in enumerate(self._cameras):
            if place < len(shown) or (place == 0 and view.session):
                camera.show(view.snapshot, shown[place] if place < len(shown) else None)
            camera.display = place == 0 or place < len(shown)
        self._request(view, shown)
        run_map, key = map_of_run(view, self._scenery, self._zoom, truth=self._truth)
        self._map.show(run_map, key)

    def _look_for_score(self) -> None:
        result = self.feed.view.result
        if result is None or self._score:
            return
        path = result_rows.scores_path(result)
        self._score = result_rows.headline_of(path) if path.is_file() else ""
        if self._score:
            self._show_all()

    def _request(self, view: RunView, shown: list[Channel]) -> None:
        """Have the feed fetch the channels that are shown, no finer than they can be shown."""
        if not view.session:
            return
        beside = ["laser", "poses"]
        if self._images != "none" and any(channel.name == "image_segment" for channel in shown):
            beside.append("image_rgb")  # classes are blended with it
        offered = view.session.get("observations", ())
        pictures = [] if self._images == "none" else [channel.name for channel in shown]
        names = tuple(dict.fromkeys([*pictures, *(name for name in beside if name in offered)]))
        # Twice as many pixels as columns: their mean is smoother than every n-th pixel.
        width = min(max(2 * self._cameras[0].pixels_wide, LEAST_WIDTH_PX), MOST_WIDE_PX)
        if (names, width) != self._requested:
            self._requested = (names, width)
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
        """Ask whether to drive by hand; `esc` ends it."""
        if not self._by_hand:
            self.app.confirm(BY_HAND, "d", "drive by hand", self._begin_by_hand)

    def _begin_by_hand(self) -> None:
        started = bool(self.feed.view.session.get("started", True))
        if started and not self.feed.view.paused:
            self._command("Pausing", self.feed.pause, lambda _: self._set_by_hand(on=True))
        else:
            self._set_by_hand(on=True)

    def _set_by_hand(self, *, on: bool) -> None:
        self._by_hand = on
        self._show_all()

    def action_drive(self, where: str) -> None:
        """Take a step by hand, unless the last one is still under way."""
        action, arguments = self._teleop.action(where)
        self._command(DRIVING, partial(self.feed.drive, action, arguments))

    def action_resize(self, change: int) -> None:
        """Make steps by hand smaller or larger."""
        self._teleop = self._teleop.resized(change)
        self._show_all()

    def action_confirm(self) -> None:
        """Confirm that the operator has done what the robot asked."""
        self._command("Confirming", self.feed.confirm, lambda request: self.notify(f"Confirmed: {request}"))

    def action_stop(self) -> None:
        """Ask whether to end the run or only to stop watching. The same key again ends it, for quick users."""
        self._ask_to_end(
            "End this run?\n\nThe robot stops where it is, and the solution's episode is over.",
            {"x": "end the run now", "q": "only stop watching: the run goes on"},
            partial(self._command, "Ending the run", self.feed.stop),
        )

    def action_again(self) -> None:
        """Start a run of the same selection; one that still runs is ended first."""
        again = self._again
        if again is None:
            return
        if not self.feed.view.alive:
            again(self.feed.view.state)
            return
        self.app.confirm(
            "End this run, and start it again from the beginning?",
            "r",
            "end it and start again",
            lambda: self._command("Ending the run", self.feed.stop, lambda _: again(self.feed.view.state)),
        )

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
        """Show the ground truth on the map, or hide it."""
        self._truth = not self._truth
        if self._truth and not self._scenery.surroundings(environment_of_run(self.feed.view)).objects:
            self.notify("No ground truth of this place is installed.")
        self._show_all()

    def action_zoom(self, change: int) -> None:
        """Show less of the map, but larger; or more of it."""
        self._zoom = min(max(self._zoom + change, 0), len(ZOOMS) - 1)
        self._show_all()

    def action_snapshot(self) -> None:
        """Write the pictures and the map as PNG files, and notify their paths."""
        view = self.feed.view
        run_map, _ = map_of_run(view, self._scenery, self._zoom, truth=self._truth)

        def written(paths: list[Path]) -> None:
            self.notify("\n".join(map(str, paths)), title="Written", timeout=10)

        self._command("Writing", partial(snapshot.take, view, run_map, self._snapshots), written)

    def action_log_level(self) -> None:
        """Show the log from another level on."""
        self._log.choose(self._log.filter.next_level())

    def action_log_source(self) -> None:
        """Show the log of the next source."""
        self._log.choose(self._log.filter.next_source(self._log.sources))

    def action_log_text(self) -> None:
        """Ask for a text, and show only the lines of the log that contain it."""

        def find(text: str | None) -> None:
            if text is not None:
                self._log.choose(self._log.filter.with_text(text))

        self.app.push_screen(AskText("Lines of the log with", self._log.filter.text), find)

    def action_log_scroll(self, where: str) -> None:
        """Scroll the log."""
        self._log.scroll(where)

    def action_leave(self) -> None:
        """Stop driving by hand; or stop watching: the run goes on."""
        if self._by_hand:
            self._set_by_hand(on=False)
        else:
            super().action_leave()

    def _command(
        self, name: str, call: Callable[[], Any], done: Callable[[Any], None] = lambda _: None, *, beside: bool = True
    ) -> None:
        # A step by hand may wait for the operator, or need to be ended: no other command waits for it.
        super()._command(name, call, done, beside=beside and name != DRIVING)
