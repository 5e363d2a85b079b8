"""The output of a renderer: pictures on the host, and the device memory from which they are copied."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot.simulation import Frame
from benchbot_sim_taichi import _ti

__all__ = ["DeviceArray", "DeviceFrames", "Frame", "FrameBatch"]

PIXELS_PER_GROUP = 4
WORDS_PER_GROUP = 3
MOST_WORDS = 2**31 - 1
INFINITY_BITS = 0x7F800000


@dataclass(frozen=True)
class FrameBatch:
    """`Frame`s of N cameras: `rgb` (N, H, W, 3), `depth_m` and `instance` (N, H, W); `batch[i]` is one of them."""

    rgb: npt.NDArray[np.uint8]
    depth_m: npt.NDArray[np.float32]
    instance: npt.NDArray[np.int32]

    def __len__(self) -> int:
        """Number of cameras."""
        return len(self.depth_m)

    def __getitem__(self, index: int) -> Frame:
        """Return the picture of one camera, sharing memory with the batch."""
        return Frame(self.rgb[index], self.depth_m[index], self.instance[index])


@dataclass(frozen=True)
class DeviceArray:
    """An array in the memory of a CUDA device, as torch.as_tensor, cupy.asarray and numba.cuda.as_cuda_array take it.

    They share its memory (CUDA array interface, version 3, https://numba.readthedocs.io/en/stable/cuda/
    cuda_array_interface.html) and keep it alive; `torch.utils.dlpack` or `cupy` pass it on as DLPack.
    """

    owner: Any
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    typestr: str
    address: int

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        return {
            "shape": self.shape,
            "strides": self.strides,
            "typestr": self.typestr,
            "data": (self.address, False),
            "version": 3,
            "stream": None,
        }


@dataclass(frozen=True)
class DeviceFrames:
    """Frames of `count` cameras where the kernels left them, in one block of 32-bit `words`.

    First the depths of all pixels, then their instances, then, if `has_rgb`, each picture's bytes, filled up to whole
    groups of 4 pixels.
    """

    words: Any
    count: int
    width: int
    height: int
    has_rgb: bool

    @classmethod
    def allocate(
        cls, count: int, width: int, height: int, *, has_rgb: bool, out: "DeviceFrames | None" = None
    ) -> "DeviceFrames":
        """Room for that many pictures, not yet taken: `out` if it is given.

        Raises BenchbotError when kernels could not address it, or when `out` has another shape.
        """
        if out is not None:
            if not out.is_of(count, width, height, has_rgb):
                raise BenchbotError(
                    "The pictures do not fit into the frames given as `out`",
                    f"There are {_shape(count, width, height, has_rgb)} to take,"
                    f" and room for {_shape(out.count, out.width, out.height, out.has_rgb)}.",
                    "Give frames that `render_on_device` returned for as many such pictures, or leave `out` away.",
                )
            return out
        size = cls.words_of(count, width, height, has_rgb=has_rgb)
        if size > MOST_WORDS:
            raise BenchbotError(
                f"{count} pictures of {width} x {height} pixels are too many at once",
                f"They are {size * 4 / 1e9:.0f} GB, and kernels address at most {MOST_WORDS * 4 / 1e9:.0f} GB.",
                f"Take at most {MOST_WORDS * count // size} pictures at a time.",
            )
        return cls(_ti.empty_words(max(size, 1)), count, width, height, has_rgb)

    def is_of(self, count: int, width: int, height: int, has_rgb: bool) -> bool:
        """Return whether these are so many pictures of that size, with colours or without."""
        return (self.count, self.width, self.height, self.has_rgb) == (count, width, height, has_rgb)

    @staticmethod
    def words_of(count: int, width: int, height: int, *, has_rgb: bool) -> int:
        """Return how many words that many pictures take."""
        return count * (2 * width * height + (_rgb_words(width, height) if has_rgb else 0))

    def depth_at(self, index: int) -> int:
        """First word of a picture's depths."""
        return index * self.width * self.height

    def instance_at(self, index: int) -> int:
        """First word of a picture's instances."""
        return (self.count + index) * self.width * self.height

    def rgb_at(self, index: int) -> int:
        """First word of a picture's colours."""
        return 2 * self.count * self.width * self.height + index * _rgb_words(self.width, self.height)

    @property
    def rgb(self) -> Any:
        """(N, H, W, 3) uint8, zeros (on the host) without `has_rgb`; numpy on a CPU, else a `DeviceArray`."""
        shape = (self.count, self.height, self.width, 3)
        if not self.has_rgb:
            return np.zeros(shape, np.uint8)
        strides = (4 * _rgb_words(self.width, self.height), 3 * self.width, 3, 1)
        return self._view(self.rgb_at(0), shape, strides, "|u1")

    @property
    def depth_m(self) -> Any:
        """(N, H, W) float32, as `Frame` has it; numpy on a CPU, else a `DeviceArray`."""
        return self._plane(self.depth_at(0), "<f4")

    @property
    def instance(self) -> Any:
        """(N, H, W) int32, as `Frame` has it; numpy on a CPU, else a `DeviceArray`."""
        return self._plane(self.instance_at(0), "<i4")

    def to_host(self) -> FrameBatch:
        """Return the frames as numpy arrays that share one block of memory; from a device, after one copy."""
        words = _ti.download(self.words)
        here = DeviceFrames(words, self.count, self.width, self.height, self.has_rgb)
        return FrameBatch(here.rgb, here.depth_m, here.instance)

    def _plane(self, start: int, typestr: str) -> Any:
        shape = (self.count, self.height, self.width)
        return self._view(start, shape, (4 * self.width * self.height, 4 * self.width, 4), typestr)

    def _view(self, start: int, shape: tuple[int, ...], strides: tuple[int, ...], typestr: str) -> Any:
        if isinstance(self.words, np.ndarray):
            return np.ndarray(shape, np.dtype(typestr), self.words.data, 4 * start, strides)
        return DeviceArray(self.words, shape, strides, typestr, _ti.address(self.words) + 4 * start)


def _shape(count: int, width: int, height: int, has_rgb: bool) -> str:
    return f"{count} pictures of {width} x {height} pixels {'with' if has_rgb else 'without'} colour"


def _rgb_words(width: int, height: int) -> int:
    """Words that hold the colours of one picture."""
    return -(-width * height // PIXELS_PER_GROUP) * WORDS_PER_GROUP
