"""The image of a solution: built from its context, or found where the same context was built before."""

from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.plugins.containers import building
from benchbot.plugins.containers.context import Context
from benchbot.plugins.containers.engine import Engine, failed

if TYPE_CHECKING:
    from docker import APIClient

# With a registry's name in front nobody takes it for an image that could be pulled.
REPOSITORY = "localhost/benchbot/submission"
LABEL = "benchbot.submission"
TAG_DIGITS = 20
TAIL_LINES = 15


def built(engine: Engine, context: Context, tell: Callable[[str], object]) -> str:
    """Return the name of the context's image, which says what is in it; `tell` hears what is done, line by line.

    Raises BenchbotError with the step that failed.
    """
    from docker.errors import DockerException
    from requests.exceptions import RequestException

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
    except (DockerException, RequestException) as error:
        raise failed("build the image", error) from error


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
    with building.events(engine, context, name, {LABEL: "1"}) as events:
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


def _failed(context: Context, step: str, lines: list[str]) -> BenchbotError:
    said = list(dict.fromkeys(line.strip() for line in lines if line.strip() and line != step))
    return BenchbotError(
        "The image cannot be built.",
        "\n".join([f"{step or 'Before the first step'}:", *said[-TAIL_LINES:]]),
        f"Mend {context.folder / context.dockerfile}. What it copies is looked for in the folder that it lies in.",
        exit_code=ExitCode.SUBMISSION_FAILED,
        failure=FailureClass.AGENT,
    )
