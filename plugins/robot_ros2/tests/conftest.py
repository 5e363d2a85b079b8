import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import suppress
from itertools import cycle, islice
from pathlib import Path
from zlib import crc32

import pytest

import tests.conftest  # noqa: F401 - the sample plug-in is in the path of every process
from benchbot_robot_ros2 import ros


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let two workers at most run robots: each is several processes, all of which have to keep time."""
    for item in items:
        if not isinstance(item, pytest.Function) or Path(__file__).parent not in item.path.parents:
            continue
        if item.get_closest_marker("xdist_group") is None:
            # By this sum of their modules' names, both halves take equally long.
            half = crc32(item.module.__name__.encode()) % 2
            item.add_marker(pytest.mark.xdist_group(f"robots {half}"))


@pytest.fixture(scope="session", autouse=True)
def _no_memory_of_the_dead() -> Iterator[None]:
    """Removes the shared memory of processes that were killed here, 34 MB for each that sends pictures.

    A living process of Fast DDS holds a lock on the file beside its segment, as `fastdds shm clean` relies on, too.
    """
    yield
    for lock in Path("/dev/shm").glob("fastrtps_*_el"):
        # Another worker may be tidying up, too, and others may work on this machine.
        with suppress(BlockingIOError, FileNotFoundError, PermissionError), lock.open() as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            lock.with_name(lock.name.removesuffix("_el")).unlink()
            lock.unlink()


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A DDS domain that no other test uses now, on loopback only, for this process and its children."""
    with _free_domain() as (number, _):
        monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield number


class _free_domain:  # noqa: N801
    """Holds a free number: the kernel frees the socket that stands for it, however the process ends."""

    # Up to 101 a domain's ports lie below those that the kernel gives to clients. Each time another one, and far from
    # those of other workers: who was in a domain before is still heard of for a moment.
    _numbers = cycle((37 * os.getpid() + number) % 101 + 1 for number in range(101))

    def __enter__(self) -> tuple[int, socket.socket]:
        for number in islice(self._numbers, 101):
            self._lock = socket.socket(socket.AF_UNIX)
            try:
                self._lock.bind(f"\0benchbot-test-ros-domain-{number}")
            except OSError:
                self._lock.close()
            else:
                return number, self._lock
        raise RuntimeError("every ROS domain is in use")

    def __exit__(self, *_: object) -> None:
        self._lock.close()


ros.prepare()
