"""Images on their way out of a real podman and into it again, and what is left of them there."""

import subprocess
from contextlib import closing
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.containers import context, engine, layout, mode, transfer
from tests.plugins.containers import base_image, layouts, solutions

pytestmark = pytest.mark.xdist_group("containers")


def there(reached: engine.Engine) -> list[str]:
    with closing(reached.connect()) as client:
        tags = [tag for image in client.images() for tag in image["RepoTags"] or ()]
    return [tag for tag in tags if tag.startswith(transfer.REPOSITORY)]


def test_a_saved_image_is_loaded_once_as_the_same_and_goes_when_nobody_uses_it(
    engine_variables: dict[str, str], tmp_path: Path
) -> None:
    folder = tmp_path / "image"
    small = solutions.write(tmp_path / "small", dockerfile="FROM scratch\nCOPY solution.py /\nCOPY Dockerfile /\n")
    with (
        engine.reached() as reached,
        closing(reached.connect()) as client,
        mode.container_mode(context.find(small), print, weak_limits=True) as made,
    ):
        digest = transfer.save(reached, made.image, folder, 2**20)
        known = client.inspect_image(made.image)  # type: ignore[no-untyped-call]
        assert known["Id"].removeprefix("sha256:") == digest.removeprefix("sha256:")
        assert list(layout.check(layout.files_of(folder)).diff_ids) == known["RootFS"]["Layers"]
        assert len([path for path in folder.rglob("*") if path.is_file()]) == 6  # nothing but the image

        with transfer.in_use(folder) as lock:
            child = subprocess.Popen(["cat"], stdin=subprocess.PIPE, pass_fds=(lock,))
            for _ in range(2):
                with (
                    transfer.in_use(folder),
                    mode.container_mode(context.find(folder), print, weak_limits=True) as held,
                ):
                    assert held.image == transfer.name_of(digest.removeprefix("sha256:"))
                    assert client.inspect_image(held.image)["Id"] == known["Id"]  # type: ignore[no-untyped-call]
                transfer.remove_unused()
                assert there(reached) == [held.image]  # another one uses it
        # Whether it ended in order or was killed: the next one that looks removes what nobody uses, no child either.
        transfer.remove_unused()
        assert there(reached) == [held.image]
        child.communicate()
        transfer.remove_unused()
        assert there(reached) == []
        assert [path for path in (tmp_path / "state" / "images").rglob("*") if path.is_file()] == []
        assert client.inspect_image(made.image)["Id"] == known["Id"]  # type: ignore[no-untyped-call]

        with pytest.raises(BenchbotError, match="is too large") as raised:
            transfer.save(reached, base_image.NAME, tmp_path / "large", 2**20)
        assert f"FROM {base_image.NAME}" in raised.value.fix
        with pytest.raises(BenchbotError, match="There is no image localhost/none") as raised:
            transfer.save(reached, "localhost/none", tmp_path / "none", 2**30)
        assert raised.value.fix == "Get it: podman pull localhost/none"


def test_an_image_that_is_not_sound_never_reaches_the_engine(engine_variables: dict[str, str], tmp_path: Path) -> None:
    files = layouts.make([layouts.layer(("../../outside", b"x"))])
    folder = layouts.write(tmp_path / "image", files)
    with engine.reached() as reached:
        with pytest.raises(BenchbotError, match="not sound"):
            transfer.load(reached, folder)
        assert there(reached) == []
