import pytest

from tests.plugins.authoring.scaffold.projects import Projects, make


@pytest.fixture(scope="session")
def projects(tmp_path_factory: pytest.TempPathFactory) -> Projects:
    return make(tmp_path_factory.mktemp("scaffold"))
