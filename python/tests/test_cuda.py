"""Pictures that stay on the graphics device. Where CUDA is missing, a stand-in imports memory as the software driver
exports it: an opaque file descriptor of it is one of a file that can be mapped."""

from __future__ import annotations

import concurrent.futures
import ctypes
import gc
import mmap
import os
import struct
import sys
import types

import numpy as np
import pytest

import relief
from relief import _relief, cuda
from relief.envs import tasks
from relief.errors import GpuError

SIZE = (21, 13)  # H · W is no multiple of 4
OUTPUTS = ("color", "depth", "instance", "part", "class")


def worlds(count: int, *, size: tuple[int, int] = SIZE, samples: int = 1, outputs: tuple[str, ...] = OUTPUTS):
    """Worlds with traffic in them, each some steps farther than the one before."""
    first = relief.Sim(relief.assets() / "envs/traffic.ron")
    sims = [first, *(first.fresh() for _ in range(count - 1))]
    for i, sim in enumerate(sims):
        ego = next(iter(sim.vehicles))
        ego.add_camera("front", size=size, at=(0, 1.3, 3.5), outputs=outputs, samples=samples, every=1)
        sim.step(1 + 7 * i)
    return sims, f"{ego.name}/front"


class Runtime(types.ModuleType):
    """What `relief.cuda` calls of CUDA's runtime, by mapping what the software driver exports (Mesa,
    src/util/os_memory_fd.c: a header of size, offset and UUID, and memory from that offset on)."""

    cudaExternalMemoryDedicated = 1
    cudaExternalMemoryHandleType = types.SimpleNamespace(cudaExternalMemoryHandleTypeOpaqueFd=1)

    def __init__(self, uuid: bytes) -> None:
        super().__init__("cuda.bindings.runtime")
        self.uuid = uuid
        self.mapped: dict[int, mmap.mmap] = {}
        self.imports = 0
        self.synchronized = 0
        self.current = 3

    @staticmethod
    def cudaExternalMemoryHandleDesc() -> types.SimpleNamespace:
        return types.SimpleNamespace(handle=types.SimpleNamespace())

    @staticmethod
    def cudaExternalMemoryBufferDesc() -> types.SimpleNamespace:
        return types.SimpleNamespace()

    def cudaGetDeviceCount(self):
        return 0, 1

    def cudaGetDevice(self):
        return 0, self.current

    def cudaSetDevice(self, number: int):
        self.current = number
        return (0,)

    def cudaDeviceSynchronize(self):
        assert self.current == 0
        self.synchronized += 1
        return (0,)

    def cudaGetDeviceProperties(self, number: int):
        return 0, types.SimpleNamespace(name=b"stand-in\0\0", uuid=types.SimpleNamespace(bytes=self.uuid))

    def cudaGetErrorString(self, error: int):
        return 0, b"out of memory"

    def cudaImportExternalMemory(self, handle: types.SimpleNamespace):
        fd = handle.handle.fd
        # Mesa writes before the memory: bytes of the whole file, and where the memory begins.
        size, offset = struct.unpack("QQ", os.pread(fd, 16, 0))
        assert size >= offset + handle.size, (size, offset, handle.size)
        mapped = mmap.mmap(fd, size)
        os.close(fd)
        self.imports += 1
        return 0, (mapped, offset)

    def cudaExternalMemoryGetMappedBuffer(self, memory: tuple[mmap.mmap, int], wanted: types.SimpleNamespace):
        mapped, offset = memory
        pointer = ctypes.addressof(ctypes.c_char.from_buffer(mapped)) + offset
        self.mapped[pointer] = mapped
        return 0, pointer

    def cudaFree(self, pointer: int):
        del self.mapped[pointer]
        return (0,)

    def cudaDestroyExternalMemory(self, memory: object):
        return (0,)


@pytest.fixture
def runtime(monkeypatch: pytest.MonkeyPatch):
    """The stand-in, in the place of the package."""
    sims, name = worlds(1)
    if "llvmpipe" not in relief.adapter():
        pytest.skip(f"the stand-in maps memory of Mesa's software driver, and of no other: {relief.adapter()}")
    uuid = bytes(_relief.share(sims, name, True).device_uuid)
    made = Runtime(uuid)
    for parent in ("cuda", "cuda.bindings"):
        monkeypatch.setitem(sys.modules, parent, types.ModuleType(parent))
    monkeypatch.setitem(sys.modules, made.__name__, made)
    monkeypatch.setattr(cuda, "_devices", {})
    monkeypatch.setattr(cuda, "_automatic", None)
    yield made
    assert made.current == 3, "the device that was current is so again"
    gc.collect()
    cuda._dropped.clear()
    cuda._imported.clear()


def read(array: cuda.CudaArray) -> np.ndarray:
    """A copy of what another interface finds in memory."""
    faced = array.__cuda_array_interface__
    whole = faced["strides"][0] * faced["shape"][0]
    memory = np.frombuffer((ctypes.c_char * whole).from_address(faced["data"][0]), np.uint8)
    kind = np.dtype(faced["typestr"])
    return np.ndarray(faced["shape"], kind, memory.data, strides=faced["strides"]).copy()


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("size", [SIZE, (84, 84)])
def test_what_is_shared_is_what_numpy_has(runtime: Runtime, size: tuple[int, int], samples: int) -> None:
    sims, name = worlds(5, size=size, samples=samples)
    expected = relief.capture(sims, name)
    shared = relief.capture(sims, name, device="cuda")
    assert shared.steps == expected.steps and shared.size == size and len(shared) == 5
    assert shared.keys() == list(OUTPUTS)
    for output in OUTPUTS:
        found, own = read(shared[output]), expected[output]
        assert found.dtype.itemsize == own.dtype.itemsize, output
        np.testing.assert_array_equal(found.view(own.dtype), own, err_msg=output)
    assert (expected["class"] > 0).any() and np.isinf(expected.depth).any() and np.isfinite(expected.depth).any()


def test_memory_is_nobody_elses_while_an_array_is_held(runtime: Runtime) -> None:
    sims, name = worlds(2)
    first = relief.look(sims, name, device="cuda")
    held, before = first.depth, read(first.depth)
    pointer = held.pointer
    del first
    sims[0].step(30)
    second = relief.look(sims, name, device="cuda")
    assert second.depth.pointer != pointer
    np.testing.assert_array_equal(read(held), before)
    assert (read(second.depth) != before).any()
    del held
    gc.collect()
    third = relief.look(sims, name, device="cuda")
    assert third.depth.pointer == pointer, "what nobody holds is used again"
    assert runtime.imports == 2, "memory is imported once"


def test_memory_that_was_computed_with_is_drawn_into_behind_that(
    runtime: Runtime, monkeypatch: pytest.MonkeyPatch
) -> None:
    sims, name = worlds(1)
    taken = relief.look(sims, name, device="cuda")
    pointer = taken.color.pointer
    taken.color.__dlpack__(stream=77)
    del taken
    gc.collect()
    with monkeypatch.context() as fault:
        fault.setattr(runtime, "cudaDeviceSynchronize", lambda: (719,))
        with pytest.raises(GpuError, match="cudaDeviceSynchronize"):
            relief.look(sims, name, device="cuda")
    assert runtime.synchronized == 0
    again = relief.look(sims, name, device="cuda")
    assert runtime.synchronized == 1
    pointers = {again.color.pointer, relief.look(sims, name, device="cuda").color.pointer}
    assert pointer in pointers
    assert runtime.synchronized == 1, "nothing is waited for where nothing was taken"
    with pytest.raises(BufferError, match="stream"):
        again.color.__dlpack__(stream=0)


def test_memory_of_other_sizes_is_given_up(runtime: Runtime) -> None:
    small, large = worlds(1, size=(64, 64)), worlds(1, size=(160, 160))
    cuda.set_memory_limit(450 << 10)  # room for 400 KiB, or for 64 KiB, not for both
    try:
        for _ in range(8):
            for sims, name in (small, large):
                relief.look(sims, name, device="cuda")
                assert len(runtime.mapped) == 1
    finally:
        cuda.set_memory_limit(4 << 30)


def test_many_threads_capture(runtime: Runtime) -> None:
    sims, name = worlds(4)
    expected = [relief.look([sim], name).depth for sim in sims]

    def capture(i: int) -> bool:
        return all(
            np.array_equal(read(relief.look([sims[i]], name, device="cuda").depth), expected[i]) for _ in range(20)
        )

    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        assert all(pool.map(capture, range(4)))


def held(runtime: Runtime, sims: list[relief.Sim], name: str, pointer: int) -> bool:
    """Whether memory is somebody's: captures do not draw into it."""
    gc.collect()
    return all(own.color.pointer != pointer for own in [relief.look(sims, name, device="cuda") for _ in range(3)])


def test_a_capsule_has_the_array_and_holds_it(runtime: Runtime, monkeypatch: pytest.MonkeyPatch) -> None:
    sims, name = worlds(3)
    taken = relief.look(sims, name, device="cuda")
    pointer, expected = taken.color.pointer, read(taken.depth)
    assert taken.depth.__dlpack_device__() == (2, 0)
    # numpy takes capsules of the processor's memory, which the stand-in's is.
    monkeypatch.setattr(cuda, "CUDA", 1)
    array = np.from_dlpack(taken.depth)
    del taken
    for sim in sims:
        sim.step(30)
    assert held(runtime, sims, name, pointer)
    np.testing.assert_array_equal(array, expected)
    del array
    assert not held(runtime, sims, name, pointer)


def test_a_capsule_that_nobody_takes_gives_its_array_back(runtime: Runtime) -> None:
    sims, name = worlds(1)
    taken = relief.look(sims, name, device="cuda")
    pointer = taken.color.pointer
    taken.color.__dlpack__()
    # numpy refuses other memory than the processor's, with the capsule in hand.
    for array in (taken.color, taken.depth):
        with pytest.raises((BufferError, RuntimeError)):
            np.from_dlpack(array)
    del taken, array
    assert not held(runtime, sims, name, pointer)


def test_thousand_captures_leave_no_file_open(runtime: Runtime) -> None:
    sims, name = worlds(1, size=(4, 4), outputs=("depth",))
    relief.look(sims, name, device="cuda")
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(1000):
        relief.look(sims, name, device="cuda")
    assert len(os.listdir("/proc/self/fd")) == before
    assert len(runtime.mapped) <= 2


def test_too_many_that_are_held_are_refused(runtime: Runtime) -> None:
    sims, name = worlds(1, size=(64, 64))  # 64 KiB
    cuda.set_memory_limit(1 << 20)
    try:
        held = []
        with pytest.raises(GpuError, match="at most 1 MiB of the device: let go of arrays"):
            for _ in range(17):
                held.append(relief.look(sims, name, device="cuda").color)
        assert 8 <= len(held) <= 16, "drivers round sizes up"
        held.clear()
        gc.collect()
        assert relief.look(sims, name, device="cuda").size == (64, 64)
    finally:
        cuda.set_memory_limit(4 << 30)
    with pytest.raises(OverflowError, match="bytes"):
        cuda.set_memory_limit(-1)


@pytest.mark.parametrize("task", ["relief/LaneFollow-v0", "relief/Traffic-v0"])
def test_environments_see_the_same_on_the_device(runtime: Runtime, task: str) -> None:
    own, shared = (relief.make_vec(task, 3, size=(20, 14), device=device) for device in ("cpu", "cuda"))
    found, expected = shared.reset(seed=5), own.reset(seed=5)
    for step in range(12):
        (found, *others), (expected, *own_others) = found, expected
        if not isinstance(expected, dict):
            found, expected = {"": found}, {"": expected}
        assert found.keys() == expected.keys()
        for key, array in expected.items():
            there = found[key] if key == "state" else read(found[key])
            np.testing.assert_array_equal(there, array, err_msg=f"{key}, step {step}")
        for ours, theirs in zip(others[:3], own_others[:3]):
            np.testing.assert_equal(ours, theirs)
        actions = np.full((3, 2), [0.1 * (-1) ** step, 0.6], np.float32)
        found, expected = shared.step(actions), own.step(actions)
    assert len(runtime.mapped) <= 2, "memory is used again"
    shared.close()
    own.close()


def test_environments_that_cannot_be_on_the_device_are_refused() -> None:
    with pytest.raises(ValueError, match="device: expected 'cpu', 'cuda' or 'auto', found 'gpu'"):
        relief.make_vec("relief/Traffic-v0", 2, device="gpu")
    with pytest.raises(ValueError, match="autoreset_mode: expected NextStep or Disabled"):
        relief.make_vec("relief/Traffic-v0", 2, device="cuda", autoreset_mode="SameStep")
    with pytest.raises(ValueError, match="render_mode: expected None"):
        relief.make_vec("relief/Traffic-v0", 2, device="auto", render_mode="rgb_array")

    class Own(tasks.Traffic):
        def outcome(self, episode, capture):
            return tasks.Outcome(0.0, False, False, {})

    with pytest.raises(ValueError, match="Own looks at each environment by itself"):
        relief.make_vec(Own(), 2, device="cuda")


def test_memory_that_cuda_does_not_take_leaves_no_file_open(
    runtime: Runtime, monkeypatch: pytest.MonkeyPatch
) -> None:
    sims, name = worlds(1)
    monkeypatch.setattr(runtime, "cudaImportExternalMemory", lambda handle: (2, None))
    before = len(os.listdir("/proc/self/fd"))
    with pytest.raises(GpuError, match="cudaImportExternalMemory: out of memory"):
        relief.look(sims, name, device="cuda")
    assert len(os.listdir("/proc/self/fd")) == before


def test_a_forked_process_is_refused(runtime: Runtime) -> None:
    sims, name = worlds(1)
    kept = relief.look(sims, name, device="cuda")
    kept.color.__dlpack__()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            relief.look(sims, name, device="cuda")
        except relief.ForkedError:
            code = 0
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0


def test_missing_pieces_are_named(runtime: Runtime, monkeypatch: pytest.MonkeyPatch) -> None:
    sims, name = worlds(1)
    cpu = relief.look(sims, name)
    monkeypatch.setattr(runtime, "uuid", b"\x12" * 16)
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "1")
    named = r"none of CUDA's devices: stand-in \(12121212-1212-.*CUDA_VISIBLE_DEVICES is '1'"
    with pytest.raises(GpuError, match=named):
        relief.look(sims, name, device="cuda")
    automatic = relief.look(sims, name, device="auto")
    assert isinstance(automatic, relief.CameraBatch)
    np.testing.assert_array_equal(automatic.color, cpu.color)
    monkeypatch.setattr(runtime, "cudaGetDeviceCount", lambda: (2, None))
    with pytest.raises(GpuError, match="cudaGetDeviceCount: out of memory"):
        relief.look(sims, name, device="cuda")
    monkeypatch.setitem(sys.modules, "cuda.bindings.runtime", None)
    with pytest.raises(GpuError, match="cuda-bindings"):
        relief.look(sims, name, device="cuda")
    assert "cuda-bindings" in (cuda.why_not() or "")
    with pytest.raises(ValueError, match="device: expected 'cpu', 'cuda' or 'auto', found 'gpu'"):
        relief.look(sims, name, device="gpu")


def test_pictures_that_the_processor_makes_are_refused() -> None:
    sims, _ = worlds(2)
    for sim in sims:
        ego = next(iter(sim.vehicles))
        ego.add_camera("noisy", size=(8, 8), noise={"gain": 2}, every=1)
        ego.add_camera("boxes", size=(8, 8), outputs=("color", "boxes"), every=1)
        ego.add_camera("uneven", size=(8, 8 if sim is sims[0] else 9), every=1)
        sim.step(1)
    for sensor, message in [
        ("noisy", "made by the CPU"),
        ("boxes", 'no array on the device for output "boxes"; expected some of: color, depth'),
        ("uneven", "world 1: expected a camera of the size and outputs"),
    ]:
        with pytest.raises(ValueError, match=message):
            _relief.share(sims, f"{ego.name}/{sensor}", True)
