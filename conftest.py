"""What every test has in common."""

import os
import signal

import pytest
from hypothesis import settings

pytest_plugins = [
    "tests.browser",
    "tests.command_line",
    "tests.engines",
    "tests.garbage",
    "tests.loading",
    "tests.made_results",
    "tests.plugin_factory",
    "tests.ray_tracing",
]

# Workers, and the processes that they start, share the cores: threads of linear algebra and of networks would only wait
# for each other, those of OpenMP without giving up the core that the others need. Starting them is a third of what it
# costs to import numpy.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

# A shell that starts this in the background has it ignore Ctrl-C, which all that is interrupted here would inherit.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# A busy machine makes nothing wrong: no test has a deadline.
settings.register_profile("patient", deadline=None)
# CI judges a change, so it looks at the same examples each time; every other run looks at new ones.
settings.register_profile("ci", settings.get_profile("patient"), derandomize=True, database=None)
settings.load_profile("ci" if os.environ.get("CI") else "patient")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return half as many workers again as there are cores: much of the suite waits for processes and time-outs."""
    return -(-3 * len(os.sched_getaffinity(0)) // 2)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let one worker run the tests that share what their module makes: dealt out singly, every worker would make it."""
    for item in items:
        if isinstance(item, pytest.Function) and item.get_closest_marker("xdist_group") is None:
            made = item._fixtureinfo.name2fixturedefs.values()
            if any(fixture.scope in {"class", "module"} for definitions in made for fixture in definitions[-1:]):
                item.add_marker(pytest.mark.xdist_group(item.nodeid.partition("::")[0]))
