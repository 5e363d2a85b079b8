"""The plug-in keeps the promises that `benchbot.testing` checks."""

from benchbot.testing import check_plugin, conform


def test_the_plugin_conforms() -> None:
    conform(check_plugin("benchbot-replay"))
