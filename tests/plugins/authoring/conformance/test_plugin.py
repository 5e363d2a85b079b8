"""The sample plug-in conforms; each small plug-in that breaks one promise is found out."""

import pytest

from benchbot.testing import check_plugin
from tests.plugin_factory import DECLARES, PluginFactory
from tests.plugins.authoring.conformance.reading import broken

TASK = "name: mine\nactions: [move_next]\nobservations: [poses]\n"


def test_the_sample_plugin_and_the_box_conform() -> None:
    for distribution in ("benchbot-sample", "benchbot"):
        findings = check_plugin(distribution)
        assert broken(findings) == {}
        assert len(findings) > 5


@pytest.mark.parametrize(
    ("code", "subject", "words"),
    [
        ("import no_such_module", "import", "No module named 'no_such_module'"),
        ("print('hello')", "import", "prints at import: 'hello'"),
        ("import numpy", "import", "imports numpy at once"),
        ("", "hooks", "implements no hook"),
        (
            "from benchbot.plugin import hookimpl\n@hookimpl\ndef benchbot_simulator():\n    return []",
            "hooks",
            "benchbot_simulator",
        ),
        (
            "from benchbot.plugin import hookimpl\n@hookimpl\ndef benchbot_simulators():\n    yield 'sim_acme'",
            "hooks",
            "is not a Simulator",
        ),
        (
            "from benchbot.plugin import hookimpl\n@hookimpl\ndef benchbot_simulators():\n    raise ValueError('oops')",
            "hooks",
            "ValueError: oops",
        ),
    ],
)
def test_a_broken_promise_is_found_out(plugin_factory: PluginFactory, code: str, subject: str, words: str) -> None:
    plugin_factory.make("acme", code)
    assert words in broken(check_plugin("acme"))[f"acme: {subject}"]


def test_a_plugin_that_is_not_there_is_told_with_those_that_are() -> None:
    assert "benchbot-sample" in broken(check_plugin("acme"))["entry point"]


def test_names_of_others_are_found_out(plugin_factory: PluginFactory) -> None:
    code = "from benchbot.plugin import hookimpl\nfrom benchbot.plugin import Recorder\n"
    plugin_factory.make("acme", code + "@hookimpl\ndef benchbot_recorders():\n    yield Recorder('frames', print)")
    assert "Two recorders are called 'frames'" in broken(check_plugin("acme"))["names"]


def test_declarations_are_checked_and_unreadable_ones_are_told(plugin_factory: PluginFactory) -> None:
    wrong = TASK.replace("move_next", "move_nxt").replace("mine", "theirs")
    files = {"tasks/mine.yaml": TASK, "tasks/theirs.yaml": wrong, "tasks/bad.yaml": "a: [", "__init__.pyi": ""}
    plugin_factory.make("acme", DECLARES.format(kind="tasks"), files)
    found = broken(check_plugin("acme"))
    assert "Did you mean 'move_next'?" in found["task theirs: declaration"]
    assert "bad.yaml" in found["names"]
    assert not any(subject.startswith("task mine") for subject in found)


def test_screens_are_made_and_one_that_is_none_is_found_out(plugin_factory: PluginFactory) -> None:
    hook = "from benchbot.plugin import TuiScreen, hookimpl\n@hookimpl\ndef benchbot_screens():\n    yield TuiScreen"
    plugin_factory.make("benchbot-odd", f"{hook}('odd', 'collections:OrderedDict', 'No screen.')")
    assert "no Textual screen" in broken(check_plugin("benchbot-odd"))["screen odd"]
