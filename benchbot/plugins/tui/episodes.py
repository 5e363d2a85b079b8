"""A batch's episodes as a table, and its scores as a map of heat: solutions and robots by environments."""

from collections.abc import Sequence
from typing import ClassVar

from textual.content import Content

from benchbot.plugins.batch.status_lines import duration
from benchbot.plugins.drawing.palette import ramp
from benchbot.plugins.tui.batch_facts import DONE, OTHER, PENDING, RUNNING, STATES, style
from benchbot.plugins.tui.listing import Column, Listing
from benchbot.plugins.watching.views import EpisodeCell

NO_NUMBER = "-"
LEAST_HEAT_WIDTH, MOST_HEAT_WIDTH = 9, 24


class EpisodeTable(Listing[EpisodeCell]):
    """The episodes of a batch, a row each."""

    DEFAULT_CSS: ClassVar[str] = "".join(
        f"EpisodeTable > .cell--{state} {{ color: {each.color}; background: {each.background}; }}\n"
        for state, each in {**STATES, "other": OTHER}.items()
    )
    COMPONENT_CLASSES: ClassVar[set[str]] = {f"cell--{name}" for name in (*STATES, "other")}


def columns_of(cells: Sequence[EpisodeCell]) -> list[Column[EpisodeCell]]:
    """Return the columns of a table of episodes: those that tell something of this batch."""

    def width(texts: set[str], title: str) -> int:
        return min(max([len(title) + 1, *map(len, texts)]), 28)

    environments, robots = {cell.environment for cell in cells}, {cell.robot for cell in cells}
    solutions, settings = {cell.solution for cell in cells}, {cell.setting for cell in cells}
    found: list[Column[EpisodeCell]] = [
        Column("State", _state, lambda cell: _rank(cell.state), 17, state=_component),
        Column("Score", lambda cell: _number(cell.score, ".3f"), lambda cell: cell.score, 7, right=True),
        Column("Time", _time, lambda cell: cell.duration_s or cell.since_s, 7, right=True),
        Column("Restarts", lambda cell: _number(cell.restarts), lambda cell: cell.restarts, 9, right=True),
        Column("Attempts", lambda cell: _number(cell.attempts), lambda cell: cell.attempts, 9, right=True),
        Column("Seed", lambda cell: str(cell.seed), lambda cell: cell.seed, 5, right=True),
        Column(
            "Environment",
            lambda cell: cell.environment,
            lambda cell: cell.environment,
            width(environments, "Environment"),
        ),
    ]
    if len(solutions) > 1:
        found.append(
            Column("Solution", lambda cell: cell.solution, lambda cell: cell.solution, width(solutions, "Solution"))
        )
    if settings - {""}:
        found.append(
            Column("Setting", lambda cell: cell.setting, lambda cell: cell.setting, width(settings, "Setting"))
        )
    if len(robots) > 1:
        found.append(Column("Robot", lambda cell: cell.robot, lambda cell: cell.robot, width(robots, "Robot")))
    if any(cell.repeat for cell in cells):
        found.append(Column("Repeat", lambda cell: str(cell.repeat), lambda cell: cell.repeat, 7, right=True))
    return [*found, Column("Worker", lambda cell: cell.worker or "", lambda cell: cell.worker, 20)]


def heat(cells: Sequence[EpisodeCell], width: int, *, colored: bool) -> Content:
    """Return the mean scores of episodes: a row for each environment, a column for each solution and robot.

    A field has the mean, how many scores it is of, and ✗ with the number of episodes that failed.
    """
    fields: dict[tuple[str, str], list[EpisodeCell]] = {}
    for cell in cells:
        fields.setdefault((cell.environment, cell.who), []).append(cell)
    rows, columns = (list(dict.fromkeys(key[place] for key in fields)) for place in (0, 1))
    label = min(max([0, *map(len, rows)]), 24)
    room = min(max((width - label - 1) // max(len(columns), 1) - 1, LEAST_HEAT_WIDTH), MOST_HEAT_WIDTH)
    means = {key: _mean([cell.score for cell in found]) for key, found in fields.items()}
    known = [mean for mean in means.values() if mean is not None]
    low, high = min(known, default=0.0), max(known, default=1.0)
    head = " ".join(_cut(name, room) for name in columns)
    lines = [Content.styled(f"{'':<{label}} {head}", "$foreground 60%")]
    for row in rows:
        parts: list[Content | str] = [f"{_cut(row, label)} "]
        for column in columns:
            found = fields.get((row, column), [])
            mean = means.get((row, column))
            failed = sum(cell.state not in (DONE, PENDING, RUNNING) for cell in found)
            scored = sum(cell.score is not None for cell in found)
            said = NO_NUMBER if mean is None else f"{mean:.3f} {scored}"
            text = _cut(f" {said}" + (f" ✗{failed}" if failed else ""), room)
            parts += [Content.styled(text, _warmth(mean, low, high) if colored and mean is not None else ""), " "]
        lines.append(Content.assemble(*parts))
    return Content("\n").join(lines)


def _warmth(value: float, low: float, high: float) -> str:
    """Return the colours of a score: of a ramp that eyes of all kinds see grow lighter."""
    rank = 0.5 if high <= low else (value - low) / (high - low)
    red, green, blue = (int(part) for part in ramp()[round(235 - rank * 200)])
    dark = 0.2126 * red + 0.7152 * green + 0.0722 * blue < 130
    return f"{'#ffffff' if dark else '#000000'} on rgb({red},{green},{blue})"


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def _cut(text: str, width: int) -> str:
    return f"{text:<{width}}" if len(text) <= width else f"{text[: width - 1]}…"


def _state(cell: EpisodeCell) -> str:
    return f" {style(cell.state).letter} {cell.state}"


def _component(cell: EpisodeCell) -> str:
    return f"cell--{cell.state if cell.state in STATES else 'other'}"


def _rank(state: str) -> float:
    # What failed comes first, then what runs; what is done or pending is as it should be.
    return {RUNNING: 1, DONE: 2, PENDING: 3}.get(state, 0)


def _time(cell: EpisodeCell) -> str:
    seconds = cell.duration_s if cell.duration_s is not None else cell.since_s
    return NO_NUMBER if seconds is None else duration(seconds)


def _number(value: float | None, form: str = "d") -> str:
    return NO_NUMBER if value is None else format(value, form)
