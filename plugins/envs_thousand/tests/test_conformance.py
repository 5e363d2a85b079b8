"""The plug-in, and all that it declares, keeps the promises that `benchbot.testing` checks."""

from benchbot.testing import check_plugin, conform


def test_the_plugin_conforms() -> None:
    conform(check_plugin("benchbot-envs-thousand"))
