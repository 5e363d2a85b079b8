import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import String

from benchbot.core.channels import GIVEN_BY_EPISODES, OBSERVATIONS
from benchbot.core.errors import BenchbotError
from benchbot_robot_ros2.callbacks import find
from benchbot_robot_ros2.messages import message_type
from tests.plugin_factory import PluginFactory

HEAT = """\
from benchbot_robot_ros2.callbacks import Callback

heat = Callback("heat", {"": frozenset({"sensor_msgs/msg/Image"})}, lambda parts: parts[""].width)
laser = Callback("laser", {}, dict)
"""


@pytest.fixture
def install(tmp_path: Path) -> Iterator[Callable[..., None]]:
    """Installs distributions with a module of the same name and entry points of callbacks, for one test."""
    factory = PluginFactory(tmp_path)
    modules = set(sys.modules)

    def make(distribution: str, code: str, *points: str) -> None:
        module = factory.make(distribution, code).name
        (tmp_path / f"{module}-1.2.dist-info" / "entry_points.txt").write_text(
            "[benchbot.ros2_callbacks]\n" + "".join(f"{point}\n" for point in points)
        )

    sys.path.insert(0, str(tmp_path))
    yield make
    sys.path.remove(str(tmp_path))
    for name in set(sys.modules) - modules:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def test_every_channel_but_the_drivers_own_has_a_callback_for_types_that_are_installed() -> None:
    for name in OBSERVATIONS.keys() - {"poses"} - GIVEN_BY_EPISODES:
        callback = find(name)
        assert callback.name == name
        for ros_types in callback.types.values():
            assert all(message_type(ros_type) for ros_type in ros_types)


def test_an_unknown_callback_is_corrected() -> None:
    with pytest.raises(BenchbotError) as caught:
        find("image_rgbd")
    assert caught.value.title == "There is no callback 'image_rgbd'."
    assert "Did you mean 'image_rgb'?" in caught.value.why


def test_a_name_is_a_key_and_never_code() -> None:
    for name in ("os.getcwd()", "os:getcwd", "benchbot_robot_ros2.images:rgb", "__class__"):
        with pytest.raises(BenchbotError, match="There is no callback"):
            find(name)


def test_a_distribution_may_add_a_callback(install: Callable[..., None]) -> None:
    install("acme-heat", HEAT, "heat = acme_heat:heat")
    assert find("heat").decode({"": Image(width=7)}) == 7


def test_looking_for_one_callback_imports_no_other(install: Callable[..., None]) -> None:
    install("acme-broken", "raise SystemExit('imported')", "steam = acme_broken:steam")
    assert find("laser").name == "laser"
    with pytest.raises(BenchbotError, match=r"There is no callback 'stream'") as caught:
        find("stream")
    assert "Did you mean 'steam'?" in caught.value.why


def test_a_callback_that_cannot_be_imported_is_said_so(install: Callable[..., None]) -> None:
    install("acme-broken", "raise SystemExit('no licence')", "steam = acme_broken:steam")
    with pytest.raises(BenchbotError, match="The callback 'steam' of acme-broken cannot be used") as caught:
        find("steam")
    assert "SystemExit: no licence" in caught.value.why


def test_an_entry_point_that_leads_elsewhere_is_refused(install: Callable[..., None]) -> None:
    install("acme-odd", "odd = 42", "odd = acme_odd:odd")
    with pytest.raises(BenchbotError) as caught:
        find("odd")
    assert "acme_odd:odd is 42, not a Callback of that name" in caught.value.why


def test_two_callbacks_of_one_name_are_an_error_that_names_both(install: Callable[..., None]) -> None:
    install("acme-laser", HEAT, "laser = acme_laser:laser", "heat = acme_laser:heat")
    install("rival-heat", HEAT, "heat = rival_heat:heat")
    with pytest.raises(BenchbotError, match="more than one callback 'laser'") as caught:
        find("laser")
    assert "benchbot-robot-ros2 and by acme-laser" in caught.value.why
    with pytest.raises(BenchbotError, match="more than one callback 'heat'"):
        find("heat")


def test_a_run_restricted_to_named_distributions_uses_no_other(
    install: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    install("acme-heat", HEAT, "heat = acme_heat:heat")
    monkeypatch.setenv("BENCHBOT_PLUGINS", "benchbot-robot-ros2")
    with pytest.raises(BenchbotError, match="There is no callback 'heat'"):
        find("heat")


def picture(encoding: str, rows: list[list[int]]) -> Image:
    pixels = np.array(rows, np.uint8 if encoding == "mono8" else "<u2")
    return Image(
        encoding=encoding,
        width=pixels.shape[1],
        height=pixels.shape[0],
        step=pixels.strides[0],
        data=pixels.tobytes(),
    )


def test_segmentation_is_put_together_from_its_parts() -> None:
    seen = find("image_segment").decode(
        {
            "class_segment_img": picture("mono8", [[0, 3]]),
            "instance_segment_img": picture("16UC1", [[0, 3001]]),
            "class_ids": String(data='{"chair": 3}'),
        }
    )
    assert seen["class_segment_img"].tolist() == [[0, 3]]
    assert seen["instance_segment_img"].tolist() == [[0, 3001]]
    assert seen["class_ids"] == {"chair": 3}


@pytest.mark.parametrize("text", ["", "chair", '["chair"]', '{"chair": "3"}'])
def test_class_ids_that_are_not_numbers_by_name_are_refused_in_words(text: str) -> None:
    parts = {
        "class_segment_img": picture("mono8", [[0]]),
        "instance_segment_img": picture("16UC1", [[0]]),
        "class_ids": String(data=text),
    }
    with pytest.raises(ValueError, match="class_ids is not JSON of the form"):
        find("image_segment").decode(parts)


def test_segmentation_in_two_sizes_is_refused_in_words() -> None:
    parts = {
        "class_segment_img": picture("mono8", [[0, 0]]),
        "instance_segment_img": picture("16UC1", [[0]]),
        "class_ids": String(data="{}"),
    }
    with pytest.raises(ValueError, match=r"has the shape \(1, 2\), the instances' \(1, 1\)"):
        find("image_segment").decode(parts)
