"""How many episodes of a batch are in which state: a bar, and what its letters mean."""

from collections.abc import Sequence

from textual.content import Content

from benchbot.plugins.tui.watching import matrix_grid
from benchbot.plugins.tui.watching.matrix_grid import DONE, PENDING, RUNNING

TONES = {
    PENDING: "$foreground 45%",
    DONE: "$text-success on $success-muted",
    RUNNING: "bold #ffffff on #2a72cc",
    "agent": "#000000 on #e5a50a",
    "collision": "#ffffff on #a347ba",
    "timeout": "#ffffff on #865e3c",
    "platform": "#ffffff on #e01b24",
    "infrastructure": "#ffffff on #8a1020",
}
OTHER = "#ffffff on #5e5c64"


def state_bar(states: Sequence[str], width: int) -> Content:
    """Return a bar of so many columns, and beneath it how many episodes are in which state."""
    counted = matrix_grid.tally(states)
    columns = matrix_grid.shares(list(counted.values()), width)
    bar = [
        (matrix_grid.letter(state) * share, TONES.get(state, OTHER))
        for state, share in zip(counted, columns, strict=True)
    ]
    return Content("\n").join([Content.assemble(*bar), _legend(counted, width)])


def failures(counted: dict[str, int]) -> Content:
    """Return how often episodes failed how, a line for each class."""
    if not counted:
        return Content("none")
    lines = [
        Content.assemble((f" {matrix_grid.letter(name)} ", TONES.get(name, OTHER)), f" {count} {name}")
        for name, count in counted.items()
    ]
    return Content("\n").join(lines)


def _legend(counted: dict[str, int], width: int) -> Content:
    with_words = [f"{count} {state}" for state, count in counted.items()]
    fits = sum(len(text) + 4 for text in with_words) <= width + 2
    texts = with_words if fits else [str(count) for count in counted.values()]
    parts = [
        Content.assemble((matrix_grid.letter(state), TONES.get(state, OTHER)), f" {text}")
        for state, text in zip(counted, texts, strict=True)
    ]
    return Content("  ").join(parts)
