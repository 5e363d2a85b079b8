import base64
import json
import subprocess
import sys
import zlib
from typing import Any

import jsonpickle
import jsonpickle.ext.numpy as jsonpickle_numpy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

from benchbot.core.errors import BenchbotError
from benchbot.plugins.v2 import encoding
from tests.plugins.v2.v2_client import equal

jsonpickle_numpy.register_handlers()

pytestmark = pytest.mark.filterwarnings("ignore:keys will default:DeprecationWarning")

DTYPES = st.sampled_from(["|b1", "|i1", "|u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "<f2", "<f4", "<f8"])
SHAPES = st_numpy.array_shapes(min_dims=1, max_dims=4, min_side=0, max_side=6)
ARRAYS = DTYPES.flatmap(lambda dtype: st_numpy.arrays(np.dtype(dtype), SHAPES)).map(np.copy)
SCALARS = st.sampled_from([np.float32, np.float64, np.uint8, np.int64]).flatmap(
    lambda kind: st.integers(0, 100).map(kind)
)
LEAVES = ARRAYS | SCALARS | st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
KEYS = st.text(max_size=8).filter(lambda key: not key.startswith("py/"))
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.tuples(inner, inner) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=6,
)


@settings(max_examples=300)
@given(VALUES)
def test_the_real_jsonpickle_decodes_what_was_encoded(value: Any) -> None:
    decoded = jsonpickle.decode(encoding.observation("laser", value).decode())
    assert equal(value, decoded)


@settings(max_examples=200)
@given(ARRAYS)
def test_arrays_are_written_as_jsonpickle_writes_them_to_the_byte(array: np.ndarray[Any, Any]) -> None:
    assert encoding.observation("image_depth", array).decode() == jsonpickle.encode(array)


def test_a_small_array_is_a_list() -> None:
    encoded = encoding.observation("laser", {"scans": np.array([[1.0, np.inf]]), "range_max": 10.0})
    assert encoded == (
        b'{"scans": {"py/object": "numpy.ndarray", "dtype": "float64", "values": [[1.0, Infinity]]}, "range_max": 10.0}'
    )


def test_a_large_array_is_its_compressed_bytes() -> None:
    depth_m = np.arange(20, dtype=np.float32).reshape(4, 5)
    document = json.loads(encoding.observation("image_depth", depth_m))
    assert zlib.decompress(base64.b64decode(document.pop("values"))) == depth_m.tobytes()
    assert document == {"py/object": "numpy.ndarray", "shape": [4, 5], "dtype": "float32", "byteorder": "<"}


def test_a_colour_image_is_sent_as_bgr8() -> None:
    rgb = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)
    sent = jsonpickle.decode(encoding.observation("image_rgb", rgb).decode())
    assert sent["encoding"] == "bgr8"
    assert np.array_equal(sent["data"], rgb[..., ::-1])


def test_the_angles_of_a_pose_are_a_tuple() -> None:
    pose = {
        "parent_frame": "map",
        "translation_xyz": np.array([1.0, 2.0, 3.0]),
        "rotation_rpy": np.array([0.0, 0.5, -0.5]),
        "rotation_xyzw": np.array([0.0, 0.0, 0.0, 1.0]),
    }
    assert encoding.observation("poses", {"camera": pose}) == (
        b'{"camera": {"parent_frame": "map", '
        b'"translation_xyz": {"py/object": "numpy.ndarray", "dtype": "float64", "values": [1.0, 2.0, 3.0]}, '
        b'"rotation_rpy": {"py/tuple": [0.0, 0.5, -0.5]}, '
        b'"rotation_xyzw": {"py/object": "numpy.ndarray", "dtype": "float64", "values": [0.0, 0.0, 0.0, 1.0]}}}'
    )


@pytest.mark.parametrize("encode", [encoding.document, lambda value: encoding.observation("laser", value)])
def test_a_name_that_would_build_an_object_in_the_client_is_refused(encode: Any) -> None:
    with pytest.raises(BenchbotError, match="py/object"):
        encode({"class_ids": [{"py/object": "subprocess.Popen"}]})


def test_documents_have_sorted_keys() -> None:
    assert encoding.document({"b": np.int64(1), "a": [np.arange(2), None]}) == b'{"a":[[0,1],null],"b":1}\n'


@pytest.mark.parametrize("value", [object(), {"a": 1j}, {(1, 2): 3}])
def test_what_is_no_json_is_told(value: Any) -> None:
    with pytest.raises(BenchbotError, match="cannot be sent as JSON"):
        encoding.document(value)


def test_nothing_of_ours_needs_jsonpickle() -> None:
    code = "import sys, benchbot.supervisor.http.app; sys.exit('jsonpickle' in sys.modules or 'pickle' in dir())"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
