"""Pictures that stay on the graphics device, as arrays of CUDA: for PyTorch, JAX, CuPy and what else knows DLPack.

``relief.capture(sims, name, device="cuda")`` draws with Vulkan into memory that CUDA has as its own: nothing goes by way
of the processor. It needs Linux, a device that both Vulkan and CUDA know, and the package ``cuda-bindings``
(``pip install '.[cuda]'``).

A capture's memory is its own until all its arrays are gone; then a later capture draws into it. What is still being
computed of them is waited for before. All captures together may take 4 GiB: `set_memory_limit`.
"""

from __future__ import annotations

import collections
import importlib
import os
import weakref
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from relief import _relief
from relief.dlpack import CUDA, capsule
from relief.errors import GpuError

__all__ = ["CudaArray", "CudaBatch", "set_memory_limit", "why_not"]


def _runtime() -> Any:
    """The functions of CUDA's runtime. Raises GpuError."""
    try:
        return importlib.import_module("cuda.bindings.runtime")
    except ImportError as error:
        raise GpuError(f"arrays of CUDA need the package cuda-bindings ({error}): pip install 'relief[cuda]'") from error


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


class _Memory:
    """Memory of the graphics device, as CUDA has it."""

    def __init__(self, shared: _relief.SharedPictures) -> None:
        self.device = _device_of(shared)
        _call("cudaSetDevice", self.device)
        runtime = _runtime()
        handle = runtime.cudaExternalMemoryHandleDesc()
        handle.type = runtime.cudaExternalMemoryHandleType.cudaExternalMemoryHandleTypeOpaqueFd
        handle.size, handle.flags = shared.memory_bytes, runtime.cudaExternalMemoryDedicated
        fd = shared.open_fd()
        try:
            handle.handle.fd = fd
            self._memory = _call("cudaImportExternalMemory", handle)
        except BaseException:
            # CUDA owns what it has imported, and nothing else.
            os.close(fd)
            raise
        wanted = runtime.cudaExternalMemoryBufferDesc()
        wanted.offset, wanted.size, wanted.flags = 0, shared.memory_bytes, 0
        try:
            self.pointer = int(_call("cudaExternalMemoryGetMappedBuffer", self._memory, wanted))
        except BaseException:
            _call("cudaDestroyExternalMemory", self._memory)
            raise

    def close(self) -> None:
        """Gives the memory up, once nothing computes with it."""
        _call("cudaFree", self.pointer)
        _call("cudaDestroyExternalMemory", self._memory)


#: Imported memory by its number, the one used last at the end; and CUDA's devices by the UUIDs of Vulkan's.
_imported: collections.OrderedDict[int, _Memory] = collections.OrderedDict()
_devices: dict[bytes, int] = {}
#: Pictures that are no array any more, each with events of CUDA that come after all that was computed of them.
_returning: collections.deque[tuple[_relief.SharedPictures, list[Any]]] = collections.deque()
#: Imported memory that is kept beyond that of the last captures.
_MOST_IMPORTED = 64


def _device_of(shared: _relief.SharedPictures) -> int:
    """The number of CUDA's device that Vulkan draws with. Raises GpuError."""
    uuid = bytes(shared.device_uuid)
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
                f"pictures are drawn by {shared.device_name} ({_uuid(uuid)}), which is none of CUDA's devices: "
                f"{', '.join(known) or 'none'}{seen}"
            )
    return _devices[uuid]


def _memory_of(shared: _relief.SharedPictures) -> _Memory:
    own = _imported.pop(shared.memory, None) or _Memory(shared)
    _imported[shared.memory] = own
    return own


def _tidy() -> None:
    """Lets later captures have the memory of pictures that nothing is computed of any more."""
    for _ in range(len(_returning)):
        shared, events = _returning.popleft()
        if all(int(_runtime().cudaEventQuery(event)[0]) == 0 for event in events):
            for event in events:
                _call("cudaEventDestroy", event)
        else:
            _returning.append((shared, events))
    held = {shared.memory for shared, _ in _returning} | {number for number, count in _lent.items() if count}
    for number in [number for number in _imported if number not in held][: max(len(_imported) - _MOST_IMPORTED, 0)]:
        _imported.pop(number).close()


#: Whether ``device="auto"`` is CUDA's here; ``None``: not tried yet.
_automatic: bool | None = None
#: How many leases of imported memory there are, by its number.
_lent: collections.Counter[int] = collections.Counter()


class _Lease:
    """Pictures while arrays of them are about: what they are computed with is waited for before they are others'."""

    def __init__(self, shared: _relief.SharedPictures) -> None:
        self.memory = _memory_of(shared)
        self.streams: set[int] = set()
        _lent[shared.memory] += 1
        # A process that ends gives everything back by itself.
        weakref.finalize(self, _Lease._give_back, shared, self.memory.device, self.streams).atexit = False

    @staticmethod
    def _give_back(shared: _relief.SharedPictures, device: int, streams: set[int]) -> None:
        _lent[shared.memory] -= 1
        events = []
        if streams:
            _call("cudaSetDevice", device)
        for stream in streams:
            event = _call("cudaEventCreateWithFlags", _runtime().cudaEventDisableTiming)
            _call("cudaEventRecord", event, stream)
            events.append(event)
        _returning.append((shared, events))


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
        # Whoever takes it so does not tell its stream: the default one waits for all others that block.
        self._lease.streams.add(1)
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
        # 1 is the default stream, of which None says the same; -1: none is known.
        self._lease.streams.add(1 if stream in (None, -1) else int(stream))
        return capsule(self.pointer, self.shape, self._strides, self._typestr, self.__dlpack_device__(), self._lease)

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
        """As an array of JAX."""
        return importlib.import_module("jax.dlpack").from_dlpack(self)

    def cupy(self) -> Any:
        """As an array of CuPy."""
        return importlib.import_module("cupy").from_dlpack(self)

    def __repr__(self) -> str:
        return f"<array of CUDA device {self.device}: {self._typestr} {self.shape}>"


class CudaBatch:
    """Captures of the same camera of several worlds: what `CameraBatch` has, in CUDA's memory. Arrays have the worlds as
    their first axis: ``color`` uint8 (N, H, W, 3), ``depth`` float32 (N, H, W) in metres, ``instance`` and ``part`` int32
    (N, H, W), ``class`` uint8 (N, H, W); of environments with depths ``depth_steps`` uint8 (N, H, W). Where H · W is no multiple of 4, worlds lie some pixels apart."""

    def __init__(self, shared: _relief.SharedPictures) -> None:
        lease = _Lease(shared)
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
    """Reason why there are no arrays of CUDA here; ``None`` where there are. It opens CUDA's runtime, and draws
    nothing: whether Vulkan draws with a device of CUDA's the first capture tells."""
    try:
        return _lacking() or (None if _call("cudaGetDeviceCount") else "CUDA has no device")
    except GpuError as error:
        return str(error)


def _lacking() -> str | None:
    return None if hasattr(_relief, "share") else "arrays of CUDA need Linux"


def set_memory_limit(size: int) -> None:
    """Sets how many bytes of the graphics device captures may take together, 4 GiB by default: those that arrays are held
    of, and those that wait for their next use. A capture beyond raises GpuError."""
    reason = _lacking()
    if reason is not None:
        raise GpuError(reason)
    _relief.set_shared_memory_limit(size)


def pictures(
    sims: Sequence[_relief.Sim], sensor: str, device: str, *, due: bool = True, scale: np.ndarray | None = None
) -> Any:
    """What `relief.capture` gives with another device than ``"cpu"``, or, not ``due``, `relief.look`. ``scale``: at most
    253 positive depths, float32, ascending; there is an array ``depth_steps`` then, by the rule of
    `relief.envs.tasks.log_depth`, if the camera has depths and the arrays are CUDA's."""
    if device not in ("cuda", "auto"):
        raise ValueError(f"device: expected 'cpu', 'cuda' or 'auto', found {device!r}")
    global _automatic
    if device == "cuda" or _automatic is not False:
        reason = why_not()
        if reason is not None and device == "cuda":
            raise GpuError(reason)
        try:
            if reason is None:
                _tidy()
                batch = CudaBatch(_relief.share(sims, sensor, due, scale=scale))
                _automatic = True
                return batch
        except GpuError:
            # What went well once is a fault now, and not a reason to do without.
            if device == "cuda" or _automatic:
                raise
        _automatic = False
    draw = _relief.capture if due else _relief.look
    return draw(sims, sensor)
