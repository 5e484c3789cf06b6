"""Packages that parts of this one need, which are installed with its extras."""

from __future__ import annotations


def missing(error: ImportError, extra: str) -> ImportError:
    """The error of an import, with what installs the package."""
    kind = type(error)
    return kind(f"{error}; expected pip install 'relief[{extra}]'", name=error.name, path=error.path)
