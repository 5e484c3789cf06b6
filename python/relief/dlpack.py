"""Capsules of DLPack (its version 0.8, unversioned), by which libraries hand arrays on without a copy."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

#: Devices by DLPack's numbers (dlpack.h, DLDeviceType).
CPU, CUDA = 1, 2
#: Kinds of types by numpy's letters (dlpack.h, DLDataTypeCode).
_CODES = {"i": 0, "u": 1, "f": 2}


class _Device(ctypes.Structure):
    _fields_ = [("kind", ctypes.c_int32), ("number", ctypes.c_int32)]


class _Type(ctypes.Structure):
    _fields_ = [("code", ctypes.c_uint8), ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16)]


class _Tensor(ctypes.Structure):
    _fields_ = [
        ("data", ctypes.c_void_p),
        ("device", _Device),
        ("axes", ctypes.c_int32),
        ("type", _Type),
        ("shape", ctypes.POINTER(ctypes.c_int64)),
        ("strides", ctypes.POINTER(ctypes.c_int64)),
        ("byte_offset", ctypes.c_uint64),
    ]


class _Managed(ctypes.Structure):
    _fields_ = [("tensor", _Tensor), ("context", ctypes.c_void_p), ("deleter", ctypes.c_void_p)]


_Deleter = ctypes.CFUNCTYPE(None, ctypes.POINTER(_Managed))
_Destructor = ctypes.CFUNCTYPE(None, ctypes.c_void_p)
_NAME = b"dltensor"

#: What capsules that are not yet given back hold, by address: the struct, the memory of shapes, and the owner.
_held: dict[int, tuple[Any, ...]] = {}

_python = ctypes.pythonapi
_python.PyCapsule_New.restype = ctypes.py_object
_python.PyCapsule_New.argtypes = [ctypes.c_void_p, ctypes.c_char_p, _Destructor]
_python.PyCapsule_IsValid.restype = ctypes.c_int
_python.PyCapsule_IsValid.argtypes = [ctypes.c_void_p, ctypes.c_char_p]
_python.PyCapsule_GetPointer.restype = ctypes.c_void_p
_python.PyCapsule_GetPointer.argtypes = [ctypes.c_void_p, ctypes.c_char_p]


def _give_back(managed: Any) -> None:
    _held.pop(ctypes.addressof(managed.contents), None)


def _give_back_untaken(capsule: int) -> None:
    # One that was taken has another name, and its taker calls the deleter.
    if _python.PyCapsule_IsValid(capsule, _NAME):
        _held.pop(_python.PyCapsule_GetPointer(capsule, _NAME), None)


_delete, _destroy = _Deleter(_give_back), _Destructor(_give_back_untaken)
# Arrays may outlive this module, at the end of a process.
for _kept in (_delete, _destroy):
    _python.Py_IncRef(ctypes.py_object(_kept))


def capsule(
    pointer: int,
    shape: Sequence[int],
    strides: Sequence[int],
    typestr: str,
    device: tuple[int, int],
    owner: object,
) -> object:
    """A capsule of an array at an address. ``strides``: bytes. ``typestr``: as numpy writes it, such as ``"<f4"``.
    ``owner`` is held until the array is given back."""
    size = int(typestr[2:])
    axes = len(shape)
    steps = [stride // size for stride in strides]
    sizes, steps_of = (ctypes.c_int64 * axes)(*shape), (ctypes.c_int64 * axes)(*steps)
    managed = _Managed()
    managed.tensor = _Tensor(
        pointer, _Device(*device), axes, _Type(_CODES[typestr[1]], 8 * size, 1), sizes, steps_of, 0
    )
    managed.deleter = ctypes.cast(_delete, ctypes.c_void_p)
    address = ctypes.addressof(managed)
    _held[address] = (managed, sizes, steps_of, owner)
    made: object = _python.PyCapsule_New(address, _NAME, _destroy)
    return made
