"""What screens of `benchbot tui` are made of, for plug-ins that bring one: docs/plugins.md has an example.

Importing it imports Textual: import it in the module of a screen, never in a plug-in's own.
"""

from benchbot.plugins.screens.child_command import ChildCommand, Outcome, as_typed, error_in
from benchbot.plugins.screens.command_screen import CommandScreen, Services
from benchbot.plugins.screens.picture import PictureView
from benchbot.plugins.screens.widgets import CheckList, ChoiceField, Facts, FormField, OptionsField, Table, TextField

__all__ = [
    "CheckList",
    "ChildCommand",
    "ChoiceField",
    "CommandScreen",
    "Facts",
    "FormField",
    "OptionsField",
    "Outcome",
    "PictureView",
    "Services",
    "Table",
    "TextField",
    "as_typed",
    "error_in",
]
