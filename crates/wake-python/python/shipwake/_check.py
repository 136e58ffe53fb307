"""Checks of arguments, which raise errors of this package."""

from __future__ import annotations

import operator
import os
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import ArrayError, OptionError, TooLargeError

LARGEST_SEED = 2**64 - 1


def whole(name: str, value: Any, least: int, most: int) -> int:
    """Returns a whole number from ``least`` to ``most``."""
    try:
        number = operator.index(value)
    except TypeError:
        raise OptionError(f"{name} is {value!r:.80}, expected a whole number") from None
    if not least <= number <= most:
        raise OptionError(f"{name} is {number}, outside [{least}, {most}]")
    return number


def threads(value: Any) -> int | None:
    """Returns a number of threads, or ``None`` for one per core."""
    return None if value is None else whole("threads", value, 1, 1024)


def number(name: str, value: Any, least: float, most: float) -> float:
    """Returns a number from ``least`` to ``most``; NaN lies outside."""
    try:
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise OptionError(f"{name} is {value!r:.80}, expected a number") from None
    if not least <= result <= most:
        raise OptionError(f"{name} is {result}, outside [{least}, {most}]")
    return result


def text(name: str, value: Any) -> str:
    """Returns text that can be encoded as UTF-8."""
    if not isinstance(value, str):
        raise OptionError(f"{name} is {value!r:.80}, expected text")
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise OptionError(f"{name} is not valid Unicode: {error.reason}") from None
    return value


def path(name: str, value: Any) -> str:
    """Returns a path of the file system as text."""
    try:
        found = os.fspath(value)
    except TypeError:
        raise OptionError(f"{name} is {value!r:.80}, expected a path") from None
    found = os.fsdecode(found)
    if not found or "\0" in found:
        raise OptionError(f"{name} is {found!r:.80}, expected a path without null characters")
    return found


def array(name: str, value: Any, dimensions: int, dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Returns real numbers as a C-contiguous array of ``dtype``, without a copy if they are one already."""
    try:
        found = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise ArrayError(f"{name} is not an array: {error}") from None
    if found.dtype.kind not in "buif":
        raise ArrayError(f"{name} is an array of {found.dtype}, expected real numbers")
    if found.ndim != dimensions:
        shape = " x ".join(map(str, found.shape)) or "no dimension"
        raise ArrayError(f"{name} has the shape {shape}, expected {dimensions} dimensions")
    # Numbers too large for `dtype` become infinite, and are refused or ignored where they are used.
    try:
        with np.errstate(over="ignore"):
            return np.ascontiguousarray(found, dtype=dtype)
    except MemoryError as error:
        raise TooLargeError(f"{name} does not fit in memory: {error}") from None
