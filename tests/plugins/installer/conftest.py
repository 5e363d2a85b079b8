import shutil
from collections.abc import Iterator

import pytest

from benchbot.plugins.installer.distributions import found_in
from tests.plugins.installer import environments, wheels
from tests.plugins.installer.environments import Environment
from tests.plugins.installer.wheels import Index


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Environment, frozenset[str]]:
    """One environment for all tests, and what is in it to begin with."""
    environment = environments.make(tmp_path_factory.mktemp("installing"))
    environments.add_uv(environment)
    return environment, frozenset(found_in([environment.site]))


@pytest.fixture(scope="module")
def shared(made: tuple[Environment, frozenset[str]]) -> Environment:
    """The environment, without what the tests of another module have left in it."""
    environment, beginning = made
    left = sorted(set(found_in([environment.site])) - beginning)
    if left:
        environment.remove(*left)
    shutil.rmtree(environment.prefix / "share", ignore_errors=True)
    return environment


@pytest.fixture(scope="session")
def index(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Index]:
    with wheels.serving(tmp_path_factory.mktemp("index")) as served:
        yield served
