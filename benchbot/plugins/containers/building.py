"""A build that is watched line by line, and of which nothing half done is left when it is given up."""

from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from typing import TYPE_CHECKING, Any

from benchbot.plugins.containers.context import Context
from benchbot.plugins.containers.engine import Engine

if TYPE_CHECKING:
    from docker import APIClient

LIBPOD = "/v4.0.0/libpod/containers"
"""podman's own programming interface: docker's does not know what podman builds images in."""


@contextmanager
def events(engine: Engine, context: Context, name: str, labels: dict[str, str]) -> Iterator[Iterator[dict[str, Any]]]:
    """Yield what the engine tells while it builds (Docker Engine API, `POST /build`)."""
    with closing(engine.connect()) as client:
        before = _working(engine, client)
        answers: list[Any] = []
        client.hooks["response"].append(lambda answer, *_, **__: answers.append(answer))
        try:
            yield client.build(
                path=str(context.folder),
                dockerfile=context.dockerfile,
                tag=name,
                labels=labels,
                rm=True,
                forcerm=True,
                decode=True,
            )
        except BaseException:
            # An engine gives up when nobody listens any more. podman keeps, mounted, what it was building in.
            for answer in answers:
                answer.close()
            with closing(engine.connect()) as other:
                for container in _working(engine, other) - before:
                    other.delete(f"{other.base_url}{LIBPOD}/{container}", params={"force": "true"})
            raise


def _working(engine: Engine, client: "APIClient") -> set[str]:
    """Return the containers that podman builds images in at the moment."""
    if engine.name != "podman":
        return set()
    from requests.exceptions import RequestException

    with suppress(RequestException):
        listed = client.get(f"{client.base_url}{LIBPOD}/json", params={"all": "true", "external": "true"})
        return {str(container["Id"]) for container in listed.json() if container.get("State") == "storage"}
    return set()
