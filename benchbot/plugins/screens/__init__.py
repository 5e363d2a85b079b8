"""The parts of screens of `benchbot tui`: a command as a form, with its progress and outcome; as `benchbot.screens`."""

__all__ = ["child_command", "command_screen", "picture", "widgets"]
