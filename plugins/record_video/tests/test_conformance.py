"""The plug-in keeps the promises that `benchbot.testing` checks."""

from benchbot.testing import check_plugin, check_recorder, conform


def test_the_plugin_conforms() -> None:
    conform(check_plugin("benchbot-record-video"))


def test_the_recorders_conform() -> None:
    conform(check_recorder("video"))
    conform(check_recorder("gif"))
