"""The keys of all screens in one table: each has one meaning, whatever the screen calls it in its footer."""

from collections.abc import Mapping
from typing import NamedTuple


class Meaning(NamedTuple):
    """The meaning of a key, and the words for it in footers and in the help."""

    gloss: str
    labels: tuple[str, ...]


NEW_BATCH, COMPARE, PLUGINS, ENVIRONMENTS, DOCTOR, SETTINGS = (
    "new batch",
    "compare",
    "plug-ins",
    "environments",
    "robots and machine",
    "settings",
)

MEANINGS: Mapping[str, Meaning] = {
    "question_mark": Meaning("every key of every screen", ("Help",)),
    "ctrl+p": Meaning("the command palette: every screen and action by name", ("Commands",)),
    "right_square_bracket": Meaning("watch the next run or batch that is alive", ("Next run",)),
    "left_square_bracket": Meaning("watch the one before", ("Run before",)),
    "T": Meaning("dark, light, for the colour-blind, or the terminal's own", ("Theme",)),
    "ctrl+c": Meaning("quit; what runs goes on", ("Quit",)),
    "ctrl+q": Meaning("quit; what runs goes on", ("Quit",)),
    "q": Meaning("quit, or leave what is only to be read", ("Quit", "Back")),
    "escape": Meaning("back", ("Back", "Leave")),
    "enter": Meaning("open or choose what is marked", ("Open", "Watch", "Logs", "Choose, open", "Back")),
    "tab": Meaning("the next part of the screen", ("Go to the next part of the screen",)),
    "ctrl+s": Meaning("do what the form says", ("Start", "Submit", "Compare", "Make it", "Save")),
    "ctrl+b": Meaning("do what the form says as a job, which goes on without the screens", ("As a job",)),
    "ctrl+t": Meaning("check what the form says, starting nothing", ("Check",)),
    "ctrl+y": Meaning("copy the command line that does the same", ("Copy command",)),
    "slash": Meaning("find", ("Find",)),
    "f5": Meaning("look again", ("Look again", "Read again")),
    "x": Meaning("end it", ("End it", "Cancel")),
    "i": Meaning("install what is marked", ("Install",)),
    "u": Meaning("upgrade what is marked", ("Upgrade",)),
    "O": Meaning("the reports of all that is chosen or listed", ("Report", "all")),
    "A": Meaning("add seeds to a batch", ("Add seeds",)),
    "X": Meaning("uninstall what is marked", ("Uninstall",)),
    "j": Meaning("down", ("Down",)),
    "k": Meaning("up", ("Up",)),
    "B": Meaning("a new batch", (NEW_BATCH,)),
    "C": Meaning("compare results or batches", (COMPARE,)),
    "P": Meaning("plug-ins", (PLUGINS,)),
    "V": Meaning("make or import an environment", (ENVIRONMENTS,)),
    "D": Meaning("what is broken on this machine or robot, and its fix", (DOCTOR,)),
    "S": Meaning("settings", (SETTINGS,)),
}
"""By key as Textual names it. A plug-in's screen may have any other key (see `TuiScreen`)."""

SAME = {"colon": "ctrl+p"}
"""Keys that do what another does, for those whose terminal keeps that one."""
