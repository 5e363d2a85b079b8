"""A screen of the sample plug-in: the arenas, as `benchbot list environments` has them."""

from textual.app import ComposeResult

from benchbot.screens import CommandScreen, Facts, Outcome


class ArenasScreen(CommandScreen):
    """Lists the environments."""

    HEADING = "Arenas"

    def body(self) -> ComposeResult:
        """Yield room for the list."""
        yield Facts(id="arenas", classes="pane")

    def words(self) -> list[str]:
        """Return the command."""
        return ["list", "environments"]

    def on_mount(self) -> None:
        """List them."""
        super().on_mount()
        self.run_command([*self.words(), "--json"], self.listed, doing="Listing", only_looks=True)

    def listed(self, outcome: Outcome) -> None:
        """Show the names and types."""
        self.query_one("#arenas", Facts).tell({row["name"]: row["type"] for row in outcome.document})
