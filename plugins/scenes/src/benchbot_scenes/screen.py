"""The screen of new environments: generated from a seed, or imported from a file, with what came of it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

from PIL import Image
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import ContentSwitcher

from benchbot.plugin import BenchbotError
from benchbot.screens import ChoiceField, CommandScreen, Facts, OptionsField, Outcome, PictureView, TextField
from benchbot_scenes.generator.kinds import KINDS

GENERATE, IMPORT = "generate", "import"
WAYS = [("generate one from a seed", GENERATE), ("import one from a file", IMPORT)]
UNITS = ["auto", "m", "cm", "mm", "in", "ft"]
UP = ["auto", "y", "z"]


class EnvironmentsScreen(CommandScreen):
    """Makes an environment, shows it from above, and installs it."""

    HEADING = "Environments"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "make", "Make it", tooltip="Generate or import it"),
        Binding("i", "install", "Install", tooltip="Install what was made, so that every list has it"),
    ]
    DEFAULT_CSS = """
    EnvironmentsScreen ContentSwitcher { height: auto; }
    EnvironmentsScreen ContentSwitcher > Vertical { height: auto; }
    EnvironmentsScreen .form { width: 45%; max-width: 60; }
    EnvironmentsScreen Vertical.details { padding: 0 1; }
    EnvironmentsScreen #made { max-height: 14; overflow-y: auto; }
    Screen.-low #made, Screen.-flat #made { max-height: 7; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._folder: Path | None = None

    def body(self) -> ComposeResult:
        """Yield the two forms, and room for what came of them."""
        self._way_field = ChoiceField("Way", WAYS)
        self._kind_field = ChoiceField("Kind", [(name, name) for name in KINDS])
        self._rooms_field, self._seed_field = TextField("Rooms", "4"), TextField("Seed", "0")
        self._file_field = TextField("File", placeholder=".glb .gltf .obj .ply .stl .usd …")
        self._units_field = ChoiceField("Unit", [(name, name) for name in UNITS])
        self._up_field = ChoiceField("Up axis", [(name, name) for name in UP])
        self._labels_field = TextField("Labels", placeholder="found beside the file; a file, or none")
        self._start_field = TextField("Start", placeholder="found; X,Y or X,Y,DEG in metres")
        self._name_field = TextField("Name", placeholder="of the kind and seed, or of the file")
        self._output_field = TextField("Folder", placeholder="a new one of its name, here")
        self._robot_field = TextField("Robot", "carter")
        self._more_field = OptionsField()
        with Horizontal(classes="pane"):
            with VerticalScroll(classes="form", can_focus=False):
                yield self._way_field
                with ContentSwitcher(initial=GENERATE):
                    with Vertical(id=GENERATE):
                        yield self._kind_field
                        yield self._rooms_field
                        yield self._seed_field
                    with Vertical(id=IMPORT):
                        yield self._file_field
                        yield self._units_field
                        yield self._up_field
                        yield self._labels_field
                        yield self._start_field
                yield self._name_field
                yield self._output_field
                yield self._robot_field
                yield self._more_field
            with Vertical(classes="details main"):
                yield Facts(id="made")
                yield PictureView()

    def on_mount(self) -> None:
        """Begin with the number of rooms."""
        super().on_mount()
        self._rooms_field.focus_input()

    def words(self) -> list[str]:
        """Return the command; raises BenchbotError for a file that is missing."""
        common = {
            "--name": self._name_field.value,
            "--output-location": self._output_field.value,
            "--robot": self._robot_field.value,
        }
        options = [f"{name}={value}" for name, value in common.items() if value] + self._more_field.words
        if self._way_field.value == GENERATE:
            own = {
                "--kind": self._kind_field.value,
                "--rooms": self._rooms_field.value or "4",
                "--seed": self._seed_field.value or "0",
            }
            return ["generate-environment", *(f"{name}={value}" for name, value in own.items()), *options]
        if not self._file_field.value:
            raise BenchbotError(
                "Name a file to import.", "None was named.", "Type its path: .glb, .gltf, .obj, .ply, .stl or .usd."
            )
        own = {
            "--units": self._units_field.value,
            "--up": self._up_field.value,
            "--labels": self._labels_field.value,
            "--start": self._start_field.value,
        }
        guessed = [f"{name}={value}" for name, value in own.items() if value not in ("", "auto")]
        return ["import-environment", str(Path(self._file_field.value).expanduser()), *guessed, *options]

    def on_select_changed(self) -> None:
        """Show the form of the chosen way, and the command as it is now."""
        self.query_one(ContentSwitcher).current = self._way_field.value
        self.show_words()

    def on_input_submitted(self) -> None:
        """Make it."""
        self.action_make()

    def action_make(self) -> None:
        """Generate or import what the form says."""
        try:
            words = self.words()
        except BenchbotError as error:
            self.show_error(error)
            return
        self._tell({}, None)
        self.run_command([*words, "--json"], self._made, doing="Making the environment")

    def action_install(self) -> None:
        """Install what was made."""
        folder = self._folder
        if folder is None:
            self.notify("Make one first: ctrl+s.")
            return

        def install() -> None:
            self.run_command(["install", str(folder.absolute()), "--json"], self._installed, doing="Installing it")

        self.app.ask(f"Install {folder}? It is copied, and then every list has it.", {"y": ("install it", install)})

    def settled(self, words: Sequence[str]) -> None:
        """Have what is installed read anew."""
        if words[0] == "install":
            self.app.forget_catalog()

    def _made(self, outcome: Outcome) -> None:
        made = outcome.document
        folder = Path(made["folder"]) if "folder" in made else Path(made["declaration"]).parent.parent
        stem = str(made["environment"]).replace(":", "_")
        pictures = [folder / "maps" / f"{stem}{suffix}" for suffix in ("_above.png", ".png")]
        shown = next((path for path in pictures if path.is_file()), None)
        self._folder = folder
        self._tell(_facts(made, folder), None if shown is None else Image.open(shown))
        self.say(f"✓ Made in {folder}. i installs it; without that: --addons {folder}", "green")
        self.set_focus(None)

    def _installed(self, outcome: Outcome) -> None:
        names = ", ".join(change["name"] for change in outcome.document["changes"])
        self.say(f"✓ Installed: {names or 'it was there already'}. Every list has it now.", "green")

    def _tell(self, facts: dict[str, object], picture: Image.Image | None) -> None:
        self.query_one("#made", Facts).tell(facts)
        self.query_one(PictureView).show(picture)


def _facts(made: dict[str, Any], folder: Path) -> dict[str, object]:
    """Return what a person wants to know of a new environment, of either way."""
    classes = ", ".join(f"{count} {name}" for name, count in made["classes"].items())
    size = made.get("size_m")
    return {
        "Environment": made["environment"],
        "Rooms": ", ".join(made.get("rooms", ())),
        "Objects": classes,
        "Trajectory": f"{made['trajectory_poses']} poses",
        "Size": "" if size is None else f"{' × '.join(f'{side:.1f}' for side in size)} m",
        "Guessed": "" if size is None else f"unit {made['units']}, up {made['up']}, floor at {made['floor_z_m']:g} m",
        "To be looked at": "\n  ".join(made.get("notes", ())),
        "Folder": folder,
    }
