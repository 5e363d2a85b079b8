"""Plug-ins are loaded once per process, which holds thousands of tests, of which some see few of them or others."""

from collections.abc import Generator

import pytest

from benchbot.core import plugin_manager


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown() -> Generator[None, None, None]:
    """Forget what a test has loaded, once its environment variables are as they were before."""
    yield
    plugin_manager.load.cache_clear()
