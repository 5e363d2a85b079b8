import os
import subprocess
import sys

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.hookspecs import KINDS
from benchbot.core.plugin_manager import CALLED, Plugins, installed
from tests.plugin_factory import DECLARES, PluginFactory

SIMULATOR = """\
from benchbot.plugin import hookimpl
from benchbot.plugin import Simulator

@hookimpl
def benchbot_simulators():
    yield Simulator("sim_{name}", create=None)
"""


def load(*distributions: str) -> Plugins:
    return Plugins([info for info in installed() if info.distribution in distributions])


def test_listing_reads_metadata_and_imports_nothing(plugin_factory: PluginFactory) -> None:
    plugin_factory.make("acme-bot", "raise RuntimeError('imported')")
    (info,) = (info for info in installed() if info.distribution == "acme-bot")
    assert (info.name, info.module, info.version) == ("acme_bot", "acme_bot", "1.2")
    assert "acme_bot" not in sys.modules


def test_records_are_found_by_name(plugin_factory: PluginFactory) -> None:
    plugin_factory.make("acme-one", SIMULATOR.format(name="one"))
    plugin_factory.make("acme-two", SIMULATOR.format(name="two"))
    plugins = load("acme-one", "acme-two")
    assert {name: provided.distribution for name, provided in plugins.pool("simulators").items()} == {
        "sim_one": "acme-one",
        "sim_two": "acme-two",
    }
    with pytest.raises(BenchbotError, match="'sim_onn' is not an installed simulator") as caught:
        plugins.record("simulators", "sim_onn")
    assert "Did you mean 'sim_one'?" in caught.value.why


def test_a_clash_of_names_names_both_distributions(plugin_factory: PluginFactory) -> None:
    plugin_factory.make("acme-one", SIMULATOR.format(name="same"))
    plugin_factory.make("acme-two", SIMULATOR.format(name="same"))
    with pytest.raises(BenchbotError, match="Two simulators are called 'sim_same'") as caught:
        load("acme-one", "acme-two").pool("simulators")
    assert "'acme-one'" in caught.value.why
    assert "'acme-two'" in caught.value.why


@pytest.mark.parametrize(
    ("code", "cause"),
    [
        ("import no_such_module", "ModuleNotFoundError"),
        ("def broken(:", "SyntaxError"),
        ("raise SystemExit(1)", "SystemExit"),
        (
            "from benchbot.plugin import hookimpl\n@hookimpl\ndef benchbot_taks(): return []",
            "unknown hook 'benchbot_taks'",
        ),
        ("from benchbot.plugin import hookimpl\n@hookimpl\ndef benchbot_tasks(nonsense): return []", "nonsense"),
    ],
)
def test_a_broken_plugin_is_reported_and_harms_no_other(plugin_factory: PluginFactory, code: str, cause: str) -> None:
    plugin_factory.make("acme-broken", code)
    plugin_factory.make("acme-fine", SIMULATOR.format(name="fine"))
    plugins = load("acme-broken", "acme-fine")
    (broken,) = plugins.broken
    assert broken.info.distribution == "acme-broken"
    assert cause in broken.cause
    assert list(plugins.pool("simulators")) == ["sim_fine"]
    assert "acme-broken" in plugins.broken_hint()


def test_a_hook_that_raises_harms_no_other(plugin_factory: PluginFactory) -> None:
    code = "from benchbot.plugin import hookimpl\n@hookimpl\ndef benchbot_simulators(): raise ValueError('not today')"
    plugin_factory.make("acme-broken", code)
    plugin_factory.make("acme-fine", SIMULATOR.format(name="fine"))
    plugins = load("acme-broken", "acme-fine")
    assert list(plugins.pool("simulators")) == ["sim_fine"]
    (broken,) = plugins.broken
    assert broken.cause.startswith("ValueError: not today (")
    assert broken.cause.endswith("acme_broken/__init__.py:3)")


def test_why_the_module_of_an_entry_point_fails_is_told_with_its_line(plugin_factory: PluginFactory) -> None:
    files = {"plugin.py": "from acme_deep import inside\n", "inside.py": "import math\nimport no_such_module\n"}
    package = plugin_factory.make("acme-deep", "", files)
    entry_points = package.parent / "acme_deep-1.2.dist-info" / "entry_points.txt"
    entry_points.write_text("[benchbot]\nacme_deep = acme_deep.plugin\n")
    (broken,) = load("acme-deep").broken
    assert "ModuleNotFoundError: No module named 'no_such_module'" in broken.cause
    assert broken.cause.endswith("acme_deep/inside.py:2)")


def test_a_record_of_the_wrong_type_is_refused(plugin_factory: PluginFactory) -> None:
    plugin_factory.make(
        "acme-odd", "from benchbot.plugin import hookimpl\n@hookimpl\ndef benchbot_simulators(): yield 'sim'"
    )
    with pytest.raises(BenchbotError, match="'acme-odd' yields something that is not a Simulator"):
        load("acme-odd").pool("simulators")


@pytest.mark.parametrize("record", KINDS.values())
def test_every_field_that_takes_a_callable_is_known_to_be_called(record: type) -> None:
    assert {name for name, kind in record.__annotations__.items() if "Callable" in str(kind)} <= set(CALLED)


@pytest.mark.parametrize(
    ("kind", "record"),
    [("simulators", "Simulator"), ("robot_drivers", "RobotDriver"), ("recorders", "Recorder")],
)
def test_a_record_that_names_its_code_as_text_is_told_how_to_write_it(
    kind: str, record: str, plugin_factory: PluginFactory
) -> None:
    hook = f"@hookimpl\ndef benchbot_{kind}(): yield {record}('odd', 'acme_text.code:make')"
    plugin_factory.make("acme-text", f"from benchbot.plugin import {record}, hookimpl\n{hook}")
    with pytest.raises(BenchbotError, match=f"The {record} 'odd' of 'acme-text' cannot be used") as refused:
        load("acme-text").pool(kind)
    assert (
        refused.value.why
        == f"Its hook benchbot_{kind} gives create='acme_text.code:make', which is text and cannot be called."
    )
    assert 'create=target("acme_text.code:make")' in refused.value.fix


@pytest.mark.parametrize(("made_for", "fix"), [(2, "Upgrade BenchBot"), (0, "Upgrade the plug-in")])
def test_a_plugin_made_for_another_major_version_is_refused_in_a_sentence(
    made_for: int, fix: str, plugin_factory: PluginFactory
) -> None:
    plugin_factory.make("acme-other", f"PLUGIN_API = {made_for}\n{DECLARES.format(kind='tasks')}")
    loaded = load("acme-other")
    assert loaded.sources("tasks") == []
    (broken,) = loaded.broken
    assert f"made for version {made_for} of benchbot.plugin, and this BenchBot has version 1" in broken.cause
    assert fix in broken.cause


def test_a_plugin_made_for_this_major_version_is_loaded(plugin_factory: PluginFactory) -> None:
    plugin_factory.make("acme-same", f"PLUGIN_API = 1\n{DECLARES.format(kind='tasks')}", {"tasks/a.yaml": "name: a"})
    assert len(load("acme-same").sources("tasks")) == 1


def test_a_plugin_that_imports_what_is_gone_is_told_what_to_import(plugin_factory: PluginFactory) -> None:
    plugin_factory.make("acme-old", "from benchbot.core.catalog import Catalog")
    (broken,) = load("acme-old").broken
    assert "No module named 'benchbot.core.catalog' (" in broken.cause
    assert "__init__.py:1). Plug-ins import from benchbot.plugin" in broken.cause


def test_a_plugin_of_the_first_version_still_works(plugin_factory: PluginFactory) -> None:
    code = "from benchbot.plugin import hookimpl\nfrom benchbot.core.hookspecs import Recorder\n"
    code += "@hookimpl\ndef benchbot_recorders(): yield Recorder('old', print)"
    plugin_factory.make("acme-first", code)
    with pytest.warns(DeprecationWarning, match=r"from benchbot\.plugin"):
        assert list(load("acme-first").pool("recorders")) == ["old"]


def test_the_environment_variable_restricts_plugins(plugin_factory: PluginFactory) -> None:
    plugin_factory.make("acme-one", "")
    plugin_factory.make("acme-two", "")
    code = "from benchbot.core.plugin_manager import installed; print(*{info.distribution for info in installed()})"
    environment = {**os.environ, "PYTHONPATH": str(plugin_factory.folder), "BENCHBOT_PLUGINS": "acme-two"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert sorted(done.stdout.split()) == ["acme-two", "benchbot"]


def test_declarations_come_with_their_distribution(plugin_factory: PluginFactory) -> None:
    plugin_factory.make("acme-tasks", DECLARES.format(kind="tasks"), {"tasks/a.yaml": "name: a"})
    (source,) = load("acme-tasks").sources("tasks")
    assert source.distribution == "acme-tasks"
    assert str(source.value).endswith("tasks")
