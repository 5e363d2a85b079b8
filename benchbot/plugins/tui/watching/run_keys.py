"""The keys of the screen that watches a run."""

from textual.binding import Binding, BindingType

COLUMNS = [(0, "-tiny"), (12, "-narrow"), (50, "-medium"), (100, "-wide"), (160, "-huge")]
LINES = [(0, "-flat"), (14, "-short"), (32, "-tall")]
"""From how many on the screen is of which class: what is shown then is in run_screen.tcss."""

STEP_KEYS = (
    ("up,w", "forward", "Forwards"), ("down,s", "back", "Back"), ("left,a", "left", "Left"),
    ("right,d", "right", "Right"), ("n", "next", "Next pose"),
)  # fmt: skip

BINDINGS: list[BindingType] = [
    Binding("space", "pause", "Pause", key_display="space"),
    Binding("n", "single_step", "Step"),
    Binding("h", "by_hand", "By hand"),
    *(Binding(keys, f"drive('{where}')", name, show=where == "next") for keys, where, name in STEP_KEYS),
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
    Binding("0", "whole_map", "Whole map", show=False),
    Binding("p", "snapshot", "Picture"),
    Binding("l", "log_level", "Log level", show=False),
    Binding("v", "log_source", "Log source", show=False),
    Binding("slash", "log_text", "Find in log", show=False, key_display="/"),
    Binding("pageup", "log_scroll('page_up')", "Older log lines", show=False),
    Binding("pagedown", "log_scroll('page_down')", "Newer log lines", show=False),
    Binding("home", "log_scroll('home')", "Oldest log line", show=False),
    Binding("end", "log_scroll('end')", "Newest log lines", show=False),
    Binding("escape", "leave", "Leave"),
]
