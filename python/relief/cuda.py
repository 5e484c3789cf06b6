"""Pictures that stay on the graphics device, as arrays of CUDA: for PyTorch, JAX, CuPy and what else knows DLPack.

``relief.capture(sims, name, device="cuda")`` draws with Vulkan into memory that CUDA has as its own: nothing goes by
way of the processor. It needs Linux, a device that both Vulkan and CUDA know, and the package ``cuda-bindings``
(``pip install '.[cuda]'``).

A capture's memory is its own until all its arrays are gone; then a later capture draws into it, and waits before for
all that the device still computes. All captures together may take 4 GiB: `set_memory_limit`.
"""

from __future__ import annotations

import collections
import contextlib
import importlib
import os
import threading
import weakref
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from relief import _relief
from relief.errors import GpuError

#: The kind of device, and kinds of numbers by numpy's letters, as DLPack has them (dlpack.h, DLDeviceType and
#: DLDataTypeCode).
CUDA = 2
_CODES = {"i": 0, "u": 1, "f": 2}

__all__ = ["CudaArray", "CudaBatch", "set_memory_limit", "why_not"]


def _runtime() -> Any:
    """The functions of CUDA's runtime. Raises GpuError."""
    try:
        return importlib.import_module("cuda.bindings.runtime")
    except ImportError as error:
        message = f"arrays of CUDA need the package cuda-bindings ({error}): pip install 'relief[cuda]'"
        raise GpuError(message) from error


def _call(function: str, *given: Any) -> Any:
    """What a function of CUDA's runtime returns beside its error: nothing, a value, or several. Raises GpuError."""
    runtime = _runtime()
    error, *values = getattr(runtime, function)(*given)
    if int(error) != 0:
        _, text = runtime.cudaGetErrorString(error)
        raise GpuError(f"{function}: {text.decode() if isinstance(text, bytes) else text}")
    return values[0] if len(values) == 1 else values or None


def _name_of(properties: Any) -> str:
    name = properties.name
    return name.split(b"\0")[0].decode(errors="replace") if isinstance(name, bytes) else str(name)


def _uuid(given: bytes) -> str:
    text = given.hex()
    return "-".join((text[:8], text[8:12], text[12:16], text[16:20], text[20:]))


@contextlib.contextmanager
def _on(device: int) -> Iterator[None]:
    """Calls of CUDA's runtime for a device; the thread's own is current again behind them."""
    before = _call("cudaGetDevice")
    _call("cudaSetDevice", device)
    try:
        yield
    finally:
        _call("cudaSetDevice", before)


class _Memory:
    """Memory of the graphics device, as CUDA has it."""

    def __init__(self, shared: _relief.SharedPictures) -> None:
        self.device = _device_of(shared.device_uuid, shared.device_name)
        with _on(self.device):
            runtime = _runtime()
            handle = runtime.cudaExternalMemoryHandleDesc()
            handle.type = runtime.cudaExternalMemoryHandleType.cudaExternalMemoryHandleTypeOpaqueFd
            handle.size, handle.flags = shared.memory_bytes, runtime.cudaExternalMemoryDedicated
            handle.handle.fd = fd = shared.open_fd()
            try:
                self._memory = _call("cudaImportExternalMemory", handle)
            except GpuError:
                # CUDA owns what it has imported, and nothing else.
                os.close(fd)
                raise
            wanted = runtime.cudaExternalMemoryBufferDesc()
            wanted.offset, wanted.size, wanted.flags = 0, shared.memory_bytes, 0
            try:
                self.pointer = int(_call("cudaExternalMemoryGetMappedBuffer", self._memory, wanted))
            except GpuError:
                _runtime().cudaDestroyExternalMemory(self._memory)
                raise

    def close(self) -> None:
        """Gives the memory up, once nothing computes with it."""
        with _on(self.device):
            _call("cudaFree", self.pointer)
            _call("cudaDestroyExternalMemory", self._memory)


#: Held by whoever changes what follows, but for `_dropped`.
_lock = threading.Lock()
#: Imported memory by its number, and CUDA's devices by the UUIDs of Vulkan's.
_imported: dict[int, _Memory] = {}
_devices: dict[bytes, int] = {}
#: Pictures of which there is no array any more; and CUDA's device, where something may still compute with them.
#: Finalizers add to it, in any thread and at any time.
_dropped: collections.deque[tuple[_relief.SharedPictures, int | None]] = collections.deque()


def _device_of(uuid: bytes, name: str) -> int:
    """The number of CUDA's device that Vulkan draws with. Raises GpuError."""
    if uuid not in _devices:
        known = []
        for number in range(_call("cudaGetDeviceCount")):
            properties = _call("cudaGetDeviceProperties", number)
            own = bytes(properties.uuid.bytes)
            if own == uuid:
                _devices[uuid] = number
                break
            known.append(f"{_name_of(properties)} ({_uuid(own)})")
        else:
            hidden = os.environ.get("CUDA_VISIBLE_DEVICES")
            seen = f"; CUDA_VISIBLE_DEVICES is {hidden!r}" if hidden is not None else ""
            raise GpuError(
                f"pictures are drawn by {name} ({_uuid(uuid)}), which is none of CUDA's devices: "
                f"{', '.join(known) or 'none'}{seen}"
            )
    return _devices[uuid]


def _free_dropped() -> None:
    """Lets captures have the memory of pictures that are dropped, once all that CUDA computes has come to its end."""
    dropped = [_dropped.popleft() for _ in range(len(_dropped))]
    try:
        for device in {device for _, device in dropped if device is not None}:
            with _on(device):
                _call("cudaDeviceSynchronize")
    except BaseException:
        # It may still be computed with.
        _dropped.extend(dropped)
        raise


def _close_unused() -> bool:
    """Gives up imported memory that captures do not use again. Returns whether there was any. Raises ForkedError."""
    unused = _imported.keys() - set(_relief.shared_memory_numbers())
    for number in unused:
        _imported.pop(number).close()
    return bool(unused)


def _capture(sims: Sequence[_relief.Sim], sensor: str, due: bool, scale: np.ndarray | None) -> CudaBatch:
    with _lock:
        _close_unused()
        _free_dropped()
        try:
            shared = _relief.share(sims, sensor, due, scale=scale)
        except GpuError:
            # What Vulkan has given up for want of memory takes memory as long as CUDA has it.
            if not _close_unused():
                raise
            shared = _relief.share(sims, sensor, due, scale=scale)
        _close_unused()
        if shared.memory not in _imported:
            _imported[shared.memory] = _Memory(shared)
        return CudaBatch(shared, _Lease(shared, _imported[shared.memory]))


class _Lease:
    """Pictures while arrays of them are about."""

    def __init__(self, shared: _relief.SharedPictures, memory: _Memory) -> None:
        self.memory = memory
        #: Whether something has taken an array, to compute with it.
        self.is_used = [False]
        # A process that ends gives everything back by itself.
        weakref.finalize(self, _Lease._drop, shared, memory.device, self.is_used).atexit = False

    @staticmethod
    def _drop(shared: _relief.SharedPictures, device: int, is_used: list[bool]) -> None:
        _dropped.append((shared, device if is_used[0] else None))


class CudaArray:
    """An array of a capture in CUDA's memory, to be read only: it goes by ``__dlpack__`` and
    ``__cuda_array_interface__`` to whatever computes."""

    def __init__(self, lease: _Lease, typestr: str, shape: Sequence[int], strides: Sequence[int], offset: int) -> None:
        self._lease = lease
        self._typestr, self._strides = typestr, tuple(strides)
        #: Sizes of the axes.
        self.shape = tuple(shape)
        #: Address in CUDA's memory.
        self.pointer = lease.memory.pointer + offset

    @property
    def device(self) -> int:
        """Number of CUDA's device."""
        return self._lease.memory.device

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        self._lease.is_used[0] = True
        return {
            "shape": self.shape,
            "strides": self._strides,
            "typestr": self._typestr,
            "data": (self.pointer, True),
            "version": 3,
            "stream": None,
        }

    def __dlpack__(self, *, stream: int | None = None, **others: Any) -> object:
        """A capsule for the stream that computes with the array. It is written already: nothing is to be waited for."""
        if others.get("copy"):
            raise BufferError("expected copy=None or False: arrays of captures are not copied")
        wanted = others.get("dl_device")
        if wanted not in (None, self.__dlpack_device__()):
            raise BufferError(f"expected device {self.__dlpack_device__()}, found {wanted}")
        if stream == 0:
            raise BufferError("expected a stream of CUDA, found 0, which names none (array API, __dlpack__)")
        self._lease.is_used[0] = True
        size = int(self._typestr[2:])
        kind, strides = (_CODES[self._typestr[1]], 8 * size), [stride // size for stride in self._strides]
        return _relief.dlpack_capsule(
            self.pointer, self.__dlpack_device__(), kind, list(self.shape), strides, self._lease
        )

    def __dlpack_device__(self) -> tuple[int, int]:
        return CUDA, self.device

    def with_channel(self) -> CudaArray:
        """The same with a last axis of one, as pictures of a single channel have it."""
        shape, strides = (*self.shape, 1), (*self._strides, self._strides[-1])
        return CudaArray(self._lease, self._typestr, shape, strides, self.pointer - self._lease.memory.pointer)

    def torch(self) -> Any:
        """As a tensor of PyTorch."""
        return importlib.import_module("torch").from_dlpack(self)

    def jax(self) -> Any:
        """As an array of JAX. Raises BufferError where worlds lie apart."""
        if self.shape[0] > 1 and self._strides[0] != self._strides[1] * self.shape[1]:
            raise BufferError("JAX takes no gaps: expected a height and width whose product is a multiple of 4")
        return importlib.import_module("jax.dlpack").from_dlpack(self)

    def cupy(self) -> Any:
        """As an array of CuPy."""
        return importlib.import_module("cupy").from_dlpack(self)

    def __repr__(self) -> str:
        return f"<array of CUDA device {self.device}: {self._typestr} {self.shape}>"


class CudaBatch:
    """Captures of the same camera of several worlds: what `CameraBatch` has, in CUDA's memory. Arrays have the worlds
    as their first axis: ``color`` uint8 (N, H, W, 3), ``depth`` float32 (N, H, W) in metres, ``instance`` and ``part``
    int32 (N, H, W), ``class`` uint8 (N, H, W); of environments with depths ``depth_steps`` uint8 (N, H, W). Where H · W
    is no multiple of 4, worlds lie some pixels apart."""

    def __init__(self, shared: _relief.SharedPictures, lease: _Lease) -> None:
        self._arrays = {
            name: CudaArray(lease, typestr, shape, strides, offset)
            for name, typestr, shape, strides, offset in shared.arrays
        }
        #: Step number of each world's clock.
        self.steps: list[int] = shared.steps
        #: Width and height, pixels.
        self.size: tuple[int, int] = shared.size

    def __getattr__(self, name: str) -> CudaArray:
        arrays = self.__dict__.get("_arrays", {})
        key = "class" if name == "cls" else name
        if key not in arrays:
            raise AttributeError(f"the camera does not give {name!r}; its outputs are: {', '.join(arrays)}")
        found: CudaArray = arrays[key]
        return found

    def __getitem__(self, name: str) -> CudaArray:
        return self._arrays[name]

    def __contains__(self, name: str) -> bool:
        return name in self._arrays

    def __len__(self) -> int:
        return len(self.steps)

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def keys(self) -> list[str]:
        """The names of the arrays that there are."""
        return list(self._arrays)

    def arrays(self) -> dict[str, CudaArray]:
        """The arrays by name."""
        return dict(self._arrays)

    def torch(self) -> dict[str, Any]:
        """The arrays by name, as tensors of PyTorch."""
        return {name: array.torch() for name, array in self._arrays.items()}

    def __repr__(self) -> str:
        width, height = self.size
        return f"<pictures of {len(self)} worlds, {width}x{height}, on CUDA: {', '.join(self._arrays)}>"


def why_not() -> str | None:
    """Reason why there are no arrays of CUDA here; ``None`` where there are. Opens the graphics device and CUDA's
    runtime."""
    reason = _lacking()
    if reason is not None:
        return reason
    try:
        uuid, name = _relief.sharing_device()
        with _lock:
            _device_of(uuid, name)
    except GpuError as error:
        return str(error)
    return None


def _lacking() -> str | None:
    return None if hasattr(_relief, "share") else "arrays of CUDA need Linux"


def set_memory_limit(size: int) -> None:
    """Sets how many bytes of the graphics device captures may take together, 4 GiB by default: those that arrays are
    held of, and those that wait for their next use. A capture beyond raises GpuError."""
    reason = _lacking()
    if reason is not None:
        raise GpuError(reason)
    _relief.set_shared_memory_limit(size)


#: Whether ``device="auto"`` is CUDA's here; ``None``: not looked yet.
_automatic: bool | None = None


def pictures(
    sims: Sequence[_relief.Sim], sensor: str, device: str, *, due: bool = True, scale: np.ndarray | None = None
) -> Any:
    """What `relief.capture` gives with another device than ``"cpu"``, or, not ``due``, `relief.look`. ``scale``: at
    most 253 positive depths, float32, ascending; there is an array ``depth_steps`` then, by the rule of
    `relief.envs.tasks.log_depth`, if the camera has depths and the arrays are CUDA's."""
    global _automatic
    if device == "auto":
        if _automatic is None:
            _automatic = why_not() is None
        if not _automatic:
            draw = _relief.capture if due else _relief.look
            return draw(sims, sensor)
    elif device != "cuda":
        raise ValueError(f"device: expected 'cpu', 'cuda' or 'auto', found {device!r}")
    reason = _lacking()
    if reason is not None:
        raise GpuError(reason)
    _runtime()
    return _capture(sims, sensor, due, scale)
