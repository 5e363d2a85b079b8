import io
import struct
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Picture
from sensor_msgs.msg import CompressedImage, Image

from benchbot_robot_ros2.images import depth_m, labels, rgb

# One row of two pixels: orange, and a blue.
ORANGE_AND_BLUE = np.array([[[250, 130, 10], [1, 2, 200]]], np.uint8)


def image(
    encoding: str, width: int, data: bytes, *, height: int = 1, step: int | None = None, big: bool = False
) -> Any:
    message = Image(
        encoding=encoding, width=width, height=height, step=step or len(data) // height, is_bigendian=int(big)
    )
    message.data.frombytes(data)
    return message


def compressed(format: str, data: bytes) -> Any:  # noqa: A002
    return CompressedImage(format=format, data=data)


def saved(pixels: npt.NDArray[Any], kind: str, **options: Any) -> bytes:
    stream = io.BytesIO()
    Picture.fromarray(pixels).save(stream, kind, **options)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("encoding", "data"),
    [
        ("rgb8", bytes([250, 130, 10, 1, 2, 200])),
        ("bgr8", bytes([10, 130, 250, 200, 2, 1])),
        ("rgba8", bytes([250, 130, 10, 99, 1, 2, 200, 99])),
        ("bgra8", bytes([10, 130, 250, 99, 200, 2, 1, 99])),
    ],
)
def test_colours_come_as_red_green_blue(encoding: str, data: bytes) -> None:
    picture = rgb(image(encoding, 2, data))
    assert picture.dtype == np.uint8
    assert picture.flags.c_contiguous
    np.testing.assert_array_equal(picture, ORANGE_AND_BLUE)


def test_grey_is_the_same_in_all_channels() -> None:
    np.testing.assert_array_equal(rgb(image("mono8", 2, bytes([7, 9]))), [[[7, 7, 7], [9, 9, 9]]])


def test_rows_end_where_their_pixels_end_not_where_their_bytes_do() -> None:
    padded = image("bgr8", 1, bytes([3, 2, 1, 77, 77, 6, 5, 4, 77, 77]), height=2)
    np.testing.assert_array_equal(rgb(padded), [[[1, 2, 3]], [[4, 5, 6]]])


def test_a_plain_picture_is_not_copied() -> None:
    message = image("rgb8", 2, ORANGE_AND_BLUE.tobytes())
    assert np.shares_memory(rgb(message), np.frombuffer(message.data, np.uint8))


@pytest.mark.parametrize("big", [False, True])
def test_depth_in_metres_keeps_what_is_not_a_number(big: bool) -> None:
    values = np.array([1.25, np.nan, np.inf, -np.inf], ">f4" if big else "<f4")
    depth = depth_m(image("32FC1", 4, values.tobytes(), big=big))
    assert depth.dtype == np.dtype("f4")
    np.testing.assert_array_equal(depth, [[1.25, np.nan, np.inf, -np.inf]])


@pytest.mark.parametrize("big", [False, True])
def test_depth_in_millimetres_becomes_metres_and_zero_is_invalid(big: bool) -> None:
    values = np.array([1, 0, 2500, 65535], ">u2" if big else "<u2")
    # A row that does not begin at a multiple of the pixels' size.
    rows = b"".join(values.tobytes() + b"?" for _ in range(2))
    depth = depth_m(image("16UC1", 4, rows, height=2, big=big))
    np.testing.assert_array_equal(depth, np.array([[0.001, np.nan, 2.5, 65.535]] * 2, np.float32))


@pytest.mark.parametrize("encoding", ["mono8", "8UC1"])
def test_labels_of_eight_bits(encoding: str) -> None:
    numbers = labels(image(encoding, 2, bytes([0, 255])), np.uint8)
    assert (numbers.dtype, numbers.tolist()) == (np.dtype("u1"), [[0, 255]])


@pytest.mark.parametrize("encoding", ["mono16", "16UC1"])
@pytest.mark.parametrize("big", [False, True])
def test_labels_of_sixteen_bits(encoding: str, big: bool) -> None:
    data = np.array([3001, 64999], ">u2" if big else "<u2").tobytes()
    numbers = labels(image(encoding, 2, data, big=big), np.uint16)
    assert (numbers.dtype, numbers.tolist()) == (np.dtype("=u2"), [[3001, 64999]])


def test_small_labels_may_come_in_the_wrong_size_and_large_ones_may_not() -> None:
    narrow, wide = image("mono8", 1, b"\x07"), image("mono16", 1, b"\x00\x01")
    assert labels(narrow, np.uint16).dtype == np.uint16
    with pytest.raises(ValueError, match="it holds the number 256, and the largest here is 255"):
        labels(wide, np.uint8)


@pytest.mark.parametrize(
    ("message", "complaint"),
    [
        (image("bayer_rggb8", 2, bytes(2)), "its encoding is 'bayer_rggb8'; those understood here: rgb8"),
        (image("rgb8", 2, bytes(5)), "its step is 5 bytes, and a row of 2 pixels of rgb8 needs 6"),
        (image("rgb8", 2, bytes(6), step=12), "it has 6 bytes, and 1 rows of 12 bytes make 12"),
        (Image(encoding="rgb8"), "it is empty: 0 x 0 pixels"),
    ],
)
def test_a_malformed_picture_is_refused_in_words(message: Any, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        rgb(message)


def test_colour_is_neither_depth_nor_labels() -> None:
    message = image("rgb8", 2, bytes(6))
    with pytest.raises(ValueError, match="its encoding is 'rgb8'"):
        depth_m(message)
    with pytest.raises(ValueError, match="its encoding is 'rgb8'"):
        labels(message, np.uint8)


@pytest.mark.parametrize("format", ["png", "", "rgb8; png compressed bgr8", "bgr8; png compressed bgr8"])
def test_a_compressed_picture_has_its_own_colours(format: str) -> None:  # noqa: A002
    np.testing.assert_array_equal(rgb(compressed(format, saved(ORANGE_AND_BLUE, "PNG"))), ORANGE_AND_BLUE)


def test_a_compressed_picture_whose_codec_was_given_red_first_is_swapped_back() -> None:
    swapped = saved(np.ascontiguousarray(ORANGE_AND_BLUE[..., ::-1]), "PNG")
    np.testing.assert_array_equal(rgb(compressed("rgb8; png compressed rgb8", swapped)), ORANGE_AND_BLUE)


def test_jpeg_is_near_the_original() -> None:
    pixels = np.full((16, 16, 3), (250, 130, 10), np.uint8)
    message = compressed("rgb8; jpeg compressed bgr8", saved(pixels, "JPEG", quality=95))
    assert np.abs(rgb(message).astype(int) - pixels).max() <= 4


def test_compressed_grey_is_replicated() -> None:
    grey = np.array([[7, 9]], np.uint8)
    np.testing.assert_array_equal(
        rgb(compressed("mono8; png compressed ", saved(grey, "PNG"))), np.stack([grey] * 3, 2)
    )


def test_compressed_labels_are_exact() -> None:
    numbers = np.array([[1001, 65535]], np.uint16)
    decoded = labels(compressed("mono16; png compressed ", saved(numbers, "PNG")), np.uint16)
    np.testing.assert_array_equal(decoded, numbers)


def test_labels_are_never_read_from_a_lossy_picture() -> None:
    with pytest.raises(ValueError, match="are no PNG picture"):
        labels(compressed("mono8; jpeg compressed ", saved(np.zeros((8, 8), np.uint8), "JPEG")), np.uint8)


@pytest.mark.parametrize("format", ["16UC1; compressedDepth png", "16UC1; compressedDepth", "16UC1"])
def test_compressed_depth_in_millimetres(format: str) -> None:  # noqa: A002
    data = struct.pack("<iff", 0, 0.0, 0.0) + saved(np.array([[0, 1500]], np.uint16), "PNG")
    np.testing.assert_array_equal(depth_m(compressed(format, data)), [[np.nan, 1.5]])


def test_depth_in_a_plain_png() -> None:
    data = saved(np.array([[0, 1500]], np.uint16), "PNG")
    np.testing.assert_array_equal(depth_m(compressed("16UC1; png compressed ", data)), [[np.nan, 1.5]])


def test_compressed_depth_in_metres_is_quantised_inverse_depth() -> None:
    # The encoder of compressed_depth_image_transport with its defaults: depth_quantization 100, depth_max 10.
    a = 100.0 * 101.0
    b = 1.0 - a / 10.0
    metres = np.array([[0.5, 1.0, 4.0, 9.9]])
    numbers = np.pad((a / metres + b).astype(np.uint16), ((0, 0), (0, 1)))
    data = struct.pack("<iff", 0, a, b) + saved(numbers, "PNG")
    depth = depth_m(compressed("32FC1; compressedDepth png", data))
    assert depth.dtype == np.float32
    # One step of the quantisation at d metres is d² / a.
    assert (np.abs(depth[0, :4] - metres[0]) <= metres[0] ** 2 / a * 1.01).all()
    assert np.isnan(depth[0, 4])


@pytest.mark.parametrize(
    ("format", "data", "complaint"),
    [
        ("rgb8; jpeg compressed bgr8", b"", "its format is 'rgb8; jpeg compressed bgr8'; understood here"),
        ("32FC1; compressedDepth rvl", b"", "set the parameter compressedDepth.format"),
        ("16UC1; compressedDepth png", bytes(40), "its 28 bytes are no PNG picture"),
        ("16UC1; compressedDepth png", saved(ORANGE_AND_BLUE, "PNG"), "its pixels are of the kind 'RGB'"),
        ("32FC1; compressedDepth png", saved(np.zeros((1, 1), np.uint16), "PNG"), "it lacks the header"),
        (
            "32FC1; compressedDepth png",
            struct.pack("<iff", 0, float("nan"), 0) + saved(np.zeros((1, 1), np.uint16), "PNG"),
            "the parameters in its header, nan and 0.0, make no depth",
        ),
    ],
)
def test_malformed_compressed_depth_is_refused_in_words(format: str, data: bytes, complaint: str) -> None:  # noqa: A002
    with pytest.raises(ValueError, match=complaint):
        depth_m(compressed(format, data))


def test_compressed_numbers_are_no_colours() -> None:
    with pytest.raises(ValueError, match="it is no colour picture"):
        rgb(compressed("16UC1; png compressed ", saved(np.zeros((1, 1), np.uint16), "PNG")))


NOISE = np.random.default_rng(1).integers(0, 255, (24, 24, 3), np.uint8)
FILES = [saved(NOISE, "PNG"), saved(NOISE, "JPEG")]


@given(st.sampled_from(FILES), st.data())
def test_a_damaged_file_is_a_picture_or_a_value_error(file: bytes, draw: st.DataObject) -> None:
    damaged = bytearray(file[: draw.draw(st.integers(0, len(file)))])
    for place in draw.draw(st.lists(st.integers(0, max(0, len(damaged) - 1)), max_size=6)) if damaged else ():
        damaged[place] = draw.draw(st.integers(0, 255))
    try:
        picture = rgb(compressed("jpeg", bytes(damaged)))
    except ValueError:
        return
    assert picture.shape[2] == 3
