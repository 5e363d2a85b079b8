"""The screen that compares sets of results: verdict, paired differences as a forest, objects won and lost."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Static

from benchbot.core.errors import BenchbotError
from benchbot.core.text import one_line
from benchbot.plugins.screens.child_command import Outcome
from benchbot.plugins.screens.command_screen import CommandScreen
from benchbot.plugins.screens.widgets import CheckList, ChoiceField, OptionsField, TextField

MOST_PAIRS = 200
LEAST_AXIS = 15
OVER = [("places", "places"), ("environments", "environments")]
NO, YES = "no", "yes"
TABLES = ("--across", "--paired-by", "--explain")
"""Options whose answer is shown as the command prints it."""
OBJECTS = [("no", NO), ("won and lost: shows the truth", YES)]


class CompareScreen(CommandScreen):
    """Chooses two sets of results or more, and shows how they differ and how sure that is."""

    HEADING = "Compare"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "compare", "Compare", tooltip="Compare what is chosen"),
        Binding("O", "report", "Report", tooltip="Make the report of each that is chosen, and open it"),
    ]
    DEFAULT_CSS = """
    CompareScreen .form { width: 45%; max-width: 64; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._sets: dict[str, Path] = {}
        self._document: Mapping[str, Any] | None = None

    def body(self) -> ComposeResult:
        """Yield the sets to choose from, and room for what comes of it."""
        self._others_field = TextField("Other sets", placeholder="NAME=PATH; PATH")
        self._score_field = TextField("Score", placeholder="the method's headline")
        self._over_field = ChoiceField("Speak of", OVER)
        self._objects_field = ChoiceField("Objects", OBJECTS)
        self._more_field = OptionsField(placeholder="--explain --paired-by scene …")
        with Horizontal(classes="pane"):
            with VerticalScroll(classes="form", can_focus=False):
                yield Static("Sets of results", classes="heading")
                yield CheckList(id="sets")
                yield self._others_field
                yield self._score_field
                yield self._over_field
                yield self._objects_field
                yield self._more_field
            with VerticalScroll(classes="details main"):
                yield Static(id="outcome", markup=False)

    def on_mount(self) -> None:
        """Look in a thread for the sets that are known."""
        super().on_mount()
        self.query_one("#sets").focus()
        self.app.in_thread(self.app.result_sets, self._offer)

    def words(self) -> list[str]:
        """Return the command; raises BenchbotError for fewer than two sets."""
        texts = self._chosen
        if len(texts) < 2:
            raise BenchbotError(
                "Choose two sets of results or more.",
                "There is nothing to compare with.",
                "Space chooses the one that is marked; others can be typed.",
            )
        score = ["--score", self._score_field.value] if self._score_field.value else []
        over = [] if self._over_field.value == OVER[0][1] else ["--over", self._over_field.value]
        objects = ["--objects"] if self._objects_field.value == YES else []
        return ["compare", *texts, *score, *over, *objects, *self._more_field.words]

    def on_check_list_chosen(self) -> None:
        """Show the command as it is now."""
        self.show_words()

    def on_input_submitted(self) -> None:
        """Compare."""
        self.action_compare()

    def on_resize(self) -> None:
        """Draw the forest for the new width."""
        self.call_after_refresh(self._show)

    def action_compare(self) -> None:
        """Score and compare what is chosen."""
        try:
            words = self.words()
        except BenchbotError as error:
            self.show_error(error)
            return
        if any(word.startswith(TABLES) for word in words):
            self.run_command(words, self._print, doing="Comparing", only_looks=True)
        else:
            self.run_command([*words, "--json"], self._compared, doing="Comparing", only_looks=True)

    def action_report(self) -> None:
        """Make the report of each set that is chosen: one report is of one solution."""
        paths = [self._sets[name] for name in self._selected]
        for path in paths:
            self.app.make_report([path])
        if not paths:
            self.notify("Choose sets of results first.")

    @property
    def _selected(self) -> list[str]:
        return self.query_one("#sets", CheckList).chosen

    @property
    def _chosen(self) -> list[str]:
        listed = [f"{name}={self._sets[name]}" for name in self._selected]
        return [*listed, *filter(None, map(str.strip, self._others_field.value.split(";")))]

    def _offer(self, found: Mapping[str, Path]) -> None:
        if not self.is_attached:
            return
        self._sets = dict(found)
        self.query_one("#sets", CheckList).offer({name: f"{name}  {_near(path)}" for name, path in found.items()})
        if not found:
            self.say("No results are known here: batches leave theirs when they end. Name folders below.")

    def _compared(self, outcome: Outcome) -> None:
        self._document = outcome.document
        self._show()
        self.query_one(".details").scroll_home(animate=False)
        self.query_one(".details").focus()

    def _print(self, outcome: Outcome) -> None:
        self._document = None
        self.query_one("#outcome", Static).update(Text("\n".join([*map(str.strip, outcome.said), "", outcome.output])))
        self.query_one(".details").focus()

    def _show(self) -> None:
        if self._document is not None and self.is_attached:
            width = self.query_one("#outcome").size.width or self.size.width // 2
            self.query_one("#outcome", Static).update(comparison_text(self._document, width))


def comparison_text(document: Mapping[str, Any], width: int) -> Text:
    """Return a comparison document as text: the verdicts, the sets, a forest for each comparison, objects, notes."""
    text = Text()
    for item in document["comparisons"]:
        sign, color = _sign(item)
        text.append(f"{sign} ", color)
        text.append(f"{item['sentence']}\n\n", "bold")
    names = max(len(item["name"]) for item in document["sets"])
    text.append(f"{document['score']}, with its 95 % interval\n", "underline")
    for item in document["sets"]:
        failures = ", ".join(f"{count} {name}" for name, count in item["failures"].items())
        scored = f"{item['scored']} of {item['expected']} scored" + (f", ✗ {failures}" if failures else "")
        text.append(
            one_line(f"{item['name']:<{names}}  {item['score']:.4f} {_interval(item['interval'])}  {scored}") + "\n"
        )
    for item in document["comparisons"]:
        text.append_text(forest(item, width, document.get("lower_is_better")))
    for item in document.get("objects", ()):
        text.append_text(_objects(item))
    for note in document["notes"]:
        text.append(f"\n! {one_line(note)}")
    return text


def forest(item: Mapping[str, Any], width: int, lower_is_better: bool | None) -> Text:
    """Return the differences of the pairs, the largest first, on one axis with zero, and below them their mean."""
    rows = sorted(item["rows"], key=lambda row: -row["difference"])
    interval = item["interval"]
    ends = [abs(row["difference"]) for row in rows] + [abs(item["difference"])]
    ends += [] if interval is None else [abs(interval["low"]), abs(interval["high"])]
    most = max(ends) or 1.0
    labels = [one_line(row["pair"]) for row in rows[:MOST_PAIRS]]
    room = max((len(label) for label in labels), default=4)
    column = max(12, min(room, width - LEAST_AXIS - 11))
    axis = max(LEAST_AXIS, min(61, width - column - 11)) // 2 * 2 + 1
    text = Text.assemble((f"\n{item['a']} − {item['b']}, pair by pair\n", "underline"))
    better = {True: -1, False: 1}.get(lower_is_better)  # type: ignore[arg-type]
    ticks = [f"−{most:.3g}", "0", f"+{most:.3g}"]
    gap = axis - sum(map(len, ticks))
    left = max(1, axis // 2 - len(ticks[0]))
    text.append(f"{'':<{column}} {ticks[0]}{'':<{left}}0{'':<{max(1, gap - left)}}{ticks[2]}\n", "dim")
    for label, row in zip(labels, rows, strict=False):
        text.append(f"{_shortened(label, column):<{column}} ")
        text.append_text(_axis(row["difference"], None, most, axis, better))
        text.append(f" {row['difference']:+.4f}\n")
    if len(rows) > MOST_PAIRS:
        text.append(f"… and {len(rows) - MOST_PAIRS} more\n", "dim")
    text.append(f"{'all together':<{column}.{column}} ", "bold")
    text.append_text(_axis(item["difference"], interval, most, axis, better))
    text.append(f" {item['difference']:+.4f}\n", "bold")
    return text


def _shortened(label: str, width: int) -> str:
    """Return a label without its middle: pairs differ at their beginning or, in the seed, at their end."""
    tail = (width - 1) // 2
    return label if len(label) <= width else f"{label[: width - 1 - tail]}…{label[-tail:]}"


def _axis(value: float, interval: Mapping[str, float] | None, most: float, width: int, better: int | None) -> Text:
    """Return one line of a forest: zero, the interval if there is one, and the value."""

    def place(number: float) -> int:
        return round((number / most + 1) / 2 * (width - 1))

    cells = [" "] * width
    cells[width // 2] = "│"
    if interval is not None:
        for at in range(place(interval["low"]), place(interval["high"]) + 1):
            cells[at] = "─"
        cells[place(interval["low"])], cells[place(interval["high"])] = "├", "┤"
    cells[place(value)] = "●" if interval is None else "◆"
    color = "" if better is None or value == 0 else "green" if value * better > 0 else "red"
    text = Text("".join(cells))
    text.stylize(f"bold {color}", place(value), place(value) + 1)
    return text


def _objects(item: Mapping[str, Any]) -> Text:
    text = Text.assemble(("\nObjects (this shows the truth)\n", "underline"))
    counts = f"both {item['both']}, neither {item['neither']}, in {item['episodes']} episodes of both"
    text.append(one_line(f"{item['a']} and {item['b']}: {counts}") + "\n", "dim")
    for name, sign, color, rows in ((item["a"], "+", "green", item["won"]), (item["b"], "−", "red", item["lost"])):
        text.append(one_line(f"{sign} only {name} found {len(rows)}") + "\n", f"bold {color}")
        for row in rows[:MOST_PAIRS]:
            text.append(one_line(f"  {row['class']}  {row['episode']}: {row['why']}") + "\n")
    return text


def _sign(item: Mapping[str, Any]) -> tuple[str, str]:
    if item["verdict"] in ("higher", "lower"):
        return "✓", "bold green"
    return ("=", "bold") if item["verdict"] == "equal" else ("?", "bold yellow")


def _interval(interval: Mapping[str, float] | None) -> str:
    return "[too few places]" if interval is None else f"[{interval['low']:.4f}, {interval['high']:.4f}]"


def _near(path: Path) -> str:
    """Return a path as short as it can be said from here."""
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)
