"""The image of a solution: built from its context, unless the same context was built before."""

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from typing import TYPE_CHECKING, Any

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.plugins.containers import transfer
from benchbot.plugins.containers.context import Context
from benchbot.plugins.containers.engine import Engine, api_errors, failed

if TYPE_CHECKING:
    from docker import APIClient

# With a registry's name in front it is never taken for an image that could be pulled.
REPOSITORY = "localhost/benchbot/submission"
LABEL = "benchbot.submission"
TAG_DIGITS = 20
TAIL_LINES = 15
LIBPOD = "/v4.0.0/libpod/containers"
"""podman's own API: docker's does not list the containers in which podman builds images."""


def built(engine: Engine, context: Context, tell: Callable[[str], object]) -> str:
    """Return the name of the context's image, a digest of its content; `tell` is called with each line of progress.

    Raises BenchbotError with the step that failed. An image layout is loaded instead.
    """
    if context.is_layout:
        tell(f"Loading the image in {context.folder}")
        return transfer.load(engine, context.folder)
    try:
        with closing(engine.connect()) as client:
            name = _name(client, context)
            if _identity(client, name) is not None:
                tell(f"The image is there already: {name}")
                return name
            tell(f"Building {name} from {context.folder}")
            image = _build(engine, context, name, tell)
            # The bases have come with the build; with them the name is what it is the next time.
            final = _name(client, context)
            if final != name:
                client.tag(image, REPOSITORY, final.removeprefix(f"{REPOSITORY}:"))
                client.remove_image(name, noprune=True)
            return final
    except api_errors() as error:
        raise failed("build the image", error) from error


def volumes_of(engine: Engine, image: str) -> tuple[str, ...]:
    """Return the folders that an image declares as volumes: an engine would put them onto this machine's disk."""
    try:
        with closing(engine.connect()) as client:
            config = client.inspect_image(image)["Config"] or {}  # type: ignore[no-untyped-call]
    except api_errors() as error:
        raise failed(f"say what is in {image}", error) from error
    return tuple(sorted(config.get("Volumes") or ()))


def _name(client: "APIClient", context: Context) -> str:
    return f"{REPOSITORY}:{context.digest(lambda base: _identity(client, base))[:TAG_DIGITS]}"


def _identity(client: "APIClient", name: str) -> str | None:
    from docker.errors import APIError, NotFound

    try:
        return str(client.inspect_image(name)["Id"])  # type: ignore[no-untyped-call]
    except NotFound:
        return None
    except APIError as error:
        # What no engine takes for a name, such as a variable in a Dockerfile, is not the name of an image.
        if error.is_client_error():
            return None
        raise


def _build(engine: Engine, context: Context, name: str, tell: Callable[[str], object]) -> str:
    step, lines, image = "", [""], ""
    with _build_events(engine, context, name) as events:
        for event in events:
            if "error" in event:
                raise _failed(context, step, [*lines, str(event["error"])])
            text = str(event.get("stream") or event.get("status") or "")
            image = str(event.get("aux", {}).get("ID") or image)
            for line in filter(None, (line.strip() for line in text.splitlines())):
                if line.upper().startswith("STEP "):
                    step, lines = line, []
                lines.append(line)
                tell(line)
    if not image:
        raise _failed(context, step, lines)
    return image


@contextmanager
def _build_events(engine: Engine, context: Context, name: str) -> Iterator[Iterator[dict[str, Any]]]:
    """Yield the events of a build (Docker Engine API, `POST /build`); an interrupted one leaves nothing behind."""
    with closing(engine.connect()) as client:
        before = _build_containers(engine, client)
        answers: list[Any] = []
        client.hooks["response"].append(lambda answer, *_, **__: answers.append(answer))
        try:
            yield client.build(
                path=str(context.folder),
                dockerfile=context.dockerfile,
                tag=name,
                labels={LABEL: "1"},
                rm=True,
                forcerm=True,
                decode=True,
            )
        except BaseException:
            # An engine gives up when the connection is closed. podman keeps the container of the build, mounted.
            for answer in answers:
                answer.close()
            with closing(engine.connect()) as other:
                for container in _build_containers(engine, other) - before:
                    other.delete(f"{other.base_url}{LIBPOD}/{container}", params={"force": "true"})
            raise


def _build_containers(engine: Engine, client: "APIClient") -> set[str]:
    """Return the containers in which podman is building images."""
    if engine.name != "podman":
        return set()
    from requests.exceptions import RequestException

    with suppress(RequestException):
        listed = client.get(f"{client.base_url}{LIBPOD}/json", params={"all": "true", "external": "true"})
        return {str(container["Id"]) for container in listed.json() if container.get("State") == "storage"}
    return set()


def _failed(context: Context, step: str, lines: list[str]) -> BenchbotError:
    said = list(dict.fromkeys(line.strip() for line in lines if line.strip() and line != step))
    return BenchbotError(
        "The image cannot be built.",
        "\n".join([f"{step or 'Before the first step'}:", *said[-TAIL_LINES:]]),
        f"Mend {context.folder / context.dockerfile}. What it copies is looked for in the folder that it lies in.",
        exit_code=ExitCode.SUBMISSION_FAILED,
        failure=FailureClass.AGENT,
    )
