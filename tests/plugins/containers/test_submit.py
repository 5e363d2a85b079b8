from pathlib import Path

import pytest
import yaml

from tests.cli.submitted import SELECTION
from tests.command_line import CommandLine, Here


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--containerised", "nothing"], "There is nothing of that name."),
        (["--containerised", "."], "It is a folder without one."),
        (["--containerised", "made", "--native", "true"], "--containerised was given, and a command or an example."),
        (["--containerised", "made", "--example", "hello_passive"], "--example NAME --example-containerised"),
        (["--containerised", "made", "--readable", "made"], "COPY my_file /solution/"),
        (["--example-containerised"], "Name one: --example NAME --example-containerised"),
        (["--example", "hello_passive", "--example-containerised"], "The example 'hello_passive' has no container."),
        (["--native", "true", "--gpus", "1"], "--cpus and --gpus are about one."),
        (["--sandbox", "true", "--cpus", "1"], "There is no container."),
        (["--sandbox", "true", "--v2-client"], "BenchBot v2's client cannot run in a sandbox."),
        (["--native", "true", "--weak-limits"], "A native solution cannot be limited."),
        (["--mode", "other", "--native", "true", "--weak-limits"], "--weak-limits says nothing to the mode other."),
        (["--containerised", "made", "--memory", "much"], "--memory much is no size."),
    ],
)
def test_what_cannot_be_meant_is_told_before_anything_is_built(
    cli: CommandLine, here: Here, words: list[str], said: str
) -> None:
    made = cli.folder / "made"
    made.mkdir()
    (made / "Dockerfile").write_text("FROM scratch\n")
    told = here("submit", *SELECTION, *words)
    assert told.returncode == 2
    assert said in told.stderr
    assert told.stdout == ""


def test_an_impossible_selection_is_told_before_the_image_is_built(cli: CommandLine, here: Here) -> None:
    (cli.folder / "Dockerfile").write_text("FROM localhost/no/such/image\n")
    told = here("submit", "--task", "sample:two_scenes", *SELECTION[2:], "--containerised", ".")
    assert told.returncode == 2
    assert "scene" in told.stderr
    assert "STEP" not in told.stderr


def test_without_an_engine_it_says_what_to_install(
    cli: CommandLine, here: Here, monkeypatch: pytest.MonkeyPatch
) -> None:
    (cli.folder / "Dockerfile").write_text("FROM scratch\n")
    for engine, said in (
        (f"unix://{cli.folder}/no.sock", "The container engine does not answer."),
        ("tcp://192.0.2.1:2375", "The container engine is on another machine."),
        ("", "Install podman"),
    ):
        monkeypatch.setenv("DOCKER_HOST", engine)
        monkeypatch.setenv("PATH", str(cli.folder))
        monkeypatch.setattr("benchbot.plugins.containers.engine.usual_sockets", list)
        told = here("submit", *SELECTION, "--containerised", ".")
        assert told.returncode != 0
        assert said in told.stderr


def test_the_container_of_an_example_is_found_where_its_declaration_says(tmp_path: Path) -> None:
    """As BenchBot v2 has it: the folder of the context, and a Dockerfile that may lie elsewhere."""
    from benchbot.plugins.containers import context

    for folder in ("inside", "docker"):
        (tmp_path / folder).mkdir()
    (tmp_path / "docker" / "Dockerfile.cpu").write_text("FROM scratch\n")
    (tmp_path / "inside" / "Dockerfile").write_text("FROM scratch\n")
    declared = yaml.safe_load("container_directory: inside\ncontainer_filename: docker/Dockerfile.cpu\n")
    inside = tmp_path / declared["container_directory"]
    assert context.find(inside, inside) == context.Context(inside, "Dockerfile")
    elsewhere = tmp_path / declared["container_filename"]
    assert context.find(elsewhere, inside) == context.Context(inside, str(elsewhere))
