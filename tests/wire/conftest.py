from tests.supervisor.conftest import _folders_of_its_own

__all__ = ["_folders_of_its_own"]
