"""The visualiser, on a machine without a display: its pictures are files."""

import copy
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from benchbot.api.tools import SUPPORTED_OBSERVATIONS, ObservationVisualiser
from benchbot.core.errors import BenchbotError

TITLES = {
    "image_rgb": "image_rgb",
    "image_depth": "image_depth",
    "laser": "laser (robot frame)",
    "lidar": "lidar (ranges)",
    "poses": "poses (world frame)",
    "image_class": "image_class",
    "image_instance": "image_instance",
}


def shown(visualiser: ObservationVisualiser) -> NDArray[Any]:
    """Return the panels in the grid (rows, columns)."""
    assert visualiser.axs is not None
    return visualiser.axs


def test_the_names_are_those_of_v2_and_the_lidar() -> None:
    assert sorted(SUPPORTED_OBSERVATIONS) == sorted(TITLES)


@pytest.mark.parametrize(
    ("names", "grid"),
    [
        (["image_class"], [["image_class"]]),
        (["image_rgb", "laser"], [["image_rgb"], ["laser"]]),
        (["image_rgb", "image_depth", "laser"], [["image_rgb", "laser"], ["image_depth", None]]),
        (["image_rgb", "image_depth", "laser", "poses"], [["image_rgb", "laser"], ["image_depth", "poses"]]),
        (
            ["image_rgb", "image_depth", "lidar", "poses", "image_instance"],
            [["image_rgb", "lidar", "image_instance"], ["image_depth", "poses", None]],
        ),
        (
            ["image_rgb", "image_depth", "laser", "poses", "image_class", "image_instance"],
            [["image_rgb", "laser", "image_class"], ["image_depth", "poses", "image_instance"]],
        ),
    ],
    ids=len,
)
def test_panels_fill_two_rows_column_by_column(
    tmp_path: Path, observations: dict[str, Any], names: list[str], grid: list[list[str | None]]
) -> None:
    path = tmp_path / "picture.png"
    visualiser = ObservationVisualiser(names, image_path=path)
    visualiser.visualise(observations, step_count=3)

    panels = [[None if axes is None else axes.get_title() for axes in row] for row in shown(visualiser)]
    assert panels == [[None if name is None else TITLES[name] for name in row] for row in grid]
    assert visualiser.fig is not None
    assert visualiser.fig.get_suptitle() == "Agent Observations (step # 3)"
    assert Image.open(path).size == (480 * len(grid[0]), 360 * len(grid))


def test_every_step_overwrites_the_picture(
    tmp_path: Path, observations: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "picture.png"
    visualiser = ObservationVisualiser(["image_rgb"], image_path=path)
    visualiser.visualise(observations)
    first = path.read_bytes()
    observations["image_rgb"] = observations["image_rgb"][..., ::-1].copy()
    visualiser.visualise(observations)

    assert path.read_bytes() != first
    assert list(tmp_path.iterdir()) == [path]
    assert capsys.readouterr().out.count(str(path)) == 1


def test_observations_are_left_as_they_were(tmp_path: Path, observations: dict[str, Any]) -> None:
    before = copy.deepcopy(observations)
    ObservationVisualiser(SUPPORTED_OBSERVATIONS, image_path=tmp_path / "picture.png").visualise(observations)

    np.testing.assert_equal(observations, before)


def test_depth_is_drawn_from_the_nearest_to_the_farthest(tmp_path: Path, observations: dict[str, Any]) -> None:
    visualiser = ObservationVisualiser(["image_depth"], image_path=tmp_path / "picture.png")
    visualiser.visualise(observations)
    (image,) = shown(visualiser)[0, 0].get_images()

    assert image.get_cmap().name == "hot"
    assert image.get_clim() == pytest.approx((1, 5))
    assert np.count_nonzero(np.ma.getmaskarray(image.get_array())) == 300


@pytest.mark.parametrize("value", [np.nan, np.inf, 2.0])
def test_depth_of_one_kind_only_is_drawn(tmp_path: Path, observations: dict[str, Any], value: float) -> None:
    observations["image_depth"][:] = value
    ObservationVisualiser(["image_depth"], image_path=tmp_path / "picture.png").visualise(observations)

    assert (tmp_path / "picture.png").exists()


def test_beams_that_met_nothing_are_left_out(tmp_path: Path, observations: dict[str, Any]) -> None:
    visualiser = ObservationVisualiser(["laser"], image_path=tmp_path / "picture.png")
    visualiser.visualise(observations)
    (beams,) = shown(visualiser)[0, 0].collections

    assert len(beams.get_offsets()) == 80
    assert np.abs(beams.get_offsets()).max() == pytest.approx(2)


@pytest.mark.parametrize("ranges", [[], [np.inf, np.inf]])
def test_a_scan_without_echo_is_drawn(tmp_path: Path, observations: dict[str, Any], ranges: list[float]) -> None:
    observations["laser"]["scans"] = np.array([[value, 0.0] for value in ranges])
    ObservationVisualiser(["laser"], image_path=tmp_path / "picture.png").visualise(observations)

    assert (tmp_path / "picture.png").exists()


def test_frames_of_one_pose_share_their_arrows(tmp_path: Path, observations: dict[str, Any]) -> None:
    visualiser = ObservationVisualiser(["poses"], image_path=tmp_path / "picture.png")
    visualiser.visualise(observations)
    axes = shown(visualiser)[0, 0]

    assert [text.get_text() for text in axes.texts] == ["map", "base_link", "lidar", "camera_left, camera"]
    assert len(axes.collections) == 3 * 4
    spans = {round(high - low, 6) for low, high in (axes.get_xlim(), axes.get_ylim(), axes.get_zlim())}
    assert len(spans) == 1


def test_what_has_no_class_is_black_and_classes_differ(tmp_path: Path, observations: dict[str, Any]) -> None:
    visualiser = ObservationVisualiser(["image_class"], image_path=tmp_path / "picture.png")
    visualiser.visualise(observations)
    image = shown(visualiser)[0, 0].get_images()[0].get_array()

    classes = observations["image_segment"]["class_segment_img"]
    assert not image[classes == 0].any()
    assert len({tuple(image[classes == number][0]) for number in (19, 20)}) == 2


def test_instances_of_a_class_share_stripes_of_its_colour(tmp_path: Path, observations: dict[str, Any]) -> None:
    visualiser = ObservationVisualiser(["image_instance"], image_path=tmp_path / "picture.png")
    visualiser.visualise(observations)
    image = shown(visualiser)[0, 0].get_images()[0].get_array()

    instances = observations["image_segment"]["instance_segment_img"]
    colors = [{tuple(color) for color in image[instances == number]} for number in (19001, 19002, 20001)]
    assert [len(pair) for pair in colors] == [2, 2, 2]
    assert len(colors[0] & colors[1]) == 1
    assert len(colors[0] & colors[2]) == 1, "both are the first of their class"


def test_an_empty_segmentation_is_drawn(tmp_path: Path, observations: dict[str, Any]) -> None:
    for name in ("class_segment_img", "instance_segment_img"):
        observations["image_segment"][name][:] = 0
    names = ["image_class", "image_instance"]
    ObservationVisualiser(names, image_path=tmp_path / "picture.png").visualise(observations)

    assert (tmp_path / "picture.png").exists()


@pytest.mark.parametrize(("names", "said"), [(["image_rbg"], "image_rgb"), ([], "nothing"), ("laser", "list")])
def test_a_wrong_list_is_an_error_in_words(names: Any, said: str) -> None:
    with pytest.raises(BenchbotError) as caught:
        ObservationVisualiser(names)

    assert said in f"{caught.value.title} {caught.value.why}"


def test_a_missing_observation_is_an_error_in_words(tmp_path: Path, observations: dict[str, Any]) -> None:
    del observations["image_segment"]
    visualiser = ObservationVisualiser(["image_rgb", "image_class"], image_path=tmp_path / "picture.png")

    with pytest.raises(BenchbotError, match="no observation 'image_segment'"):
        visualiser.visualise(observations)


def test_a_place_that_cannot_be_written_is_an_error_in_words(tmp_path: Path, observations: dict[str, Any]) -> None:
    visualiser = ObservationVisualiser(["image_rgb"], image_path=tmp_path / "missing" / "picture.png")

    with pytest.raises(BenchbotError, match="cannot be written"):
        visualiser.visualise(observations)


def run(code: str, folder: Path, **variables: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_neither_the_api_nor_the_tools_import_matplotlib(tmp_path: Path) -> None:
    code = "import sys, benchbot, benchbot.api, benchbot.api.tools, benchbot_api.tools, benchbot_api.extras; "

    assert run(code + "print('matplotlib' in sys.modules)", tmp_path) == "False\n"


def test_a_display_that_is_not_there_does_no_harm(tmp_path: Path) -> None:
    code = (
        "import numpy as np; from benchbot_api.tools import ObservationVisualiser; "
        "ObservationVisualiser(['image_rgb']).visualise({'image_rgb': np.zeros((4, 4, 3), np.uint8)})"
    )

    assert "observations.png" in run(code, tmp_path, DISPLAY=":4711")
    assert (tmp_path / "observations.png").exists()


def test_without_matplotlib_it_says_how_to_get_it(tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from benchbot.api import BenchbotError\n"
        "from benchbot.api.tools import ObservationVisualiser\n"
        "try: ObservationVisualiser(['image_rgb']).visualise({'image_rgb': None})\n"
        "except BenchbotError as error: print(error.fix)"
    )

    assert "benchbot[viz]" in run(code, tmp_path)


def test_a_window_is_drawn_into_until_it_is_closed(tmp_path: Path) -> None:
    code = (
        "import numpy as np, matplotlib.pyplot as plt; from benchbot.api.tools import ObservationVisualiser\n"
        "visualiser = ObservationVisualiser(['image_rgb'])\n"
        "for step in range(3):\n"
        "    visualiser.visualise({'image_rgb': np.zeros((4, 4, 3), np.uint8)}, step)\n"
        "    print(plt.get_fignums())\n"
        "    if step == 1: plt.close(visualiser.fig)"
    )

    # The one backend with windows that needs no display: they open in a browser, when asked to.
    assert run(code, tmp_path, MPLBACKEND="webagg") == "[1]\n[1]\n[]\n"
    assert list(tmp_path.iterdir()) == []
