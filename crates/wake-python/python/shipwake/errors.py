"""Exceptions of this package: one class per kind of error, with the library's message as text.

Every class also derives from the built-in exception that you would expect, so that ``except ValueError`` works.
"""

__all__ = [
    "ArrayError",
    "DatasetError",
    "FileError",
    "InternalError",
    "ModelError",
    "OptionError",
    "ProductError",
    "PromptError",
    "RecipeError",
    "SceneError",
    "ShipwakeError",
    "TooLargeError",
    "UnknownKeyError",
    "WeightsError",
]


class ShipwakeError(Exception):
    """Base class of all exceptions of this package."""


class SceneError(ShipwakeError, ValueError):
    """A scene has a value out of its range, values that contradict each other, or text that is not a scene file."""


class UnknownKeyError(ShipwakeError, KeyError):
    """A scene, recipe or simulation has no such key."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class PromptError(ShipwakeError, ValueError):
    """A prompt states nothing of a scene, contradicts itself, or states a value that no scene can have."""


class RecipeError(ShipwakeError, ValueError):
    """A recipe of a data set is invalid."""


class OptionError(ShipwakeError, ValueError):
    """An argument lies outside its range or is not one of the allowed values."""


class ArrayError(ShipwakeError, ValueError):
    """An array has the wrong shape or the wrong kind of numbers."""


class DatasetError(ShipwakeError, ValueError):
    """A folder is not a data set, holds another data set than expected, or is damaged."""


class WeightsError(ShipwakeError, ValueError):
    """A file of weights is damaged or belongs to another network."""


class ProductError(ShipwakeError, ValueError):
    """A file is not a readable satellite product, or is not georeferenced."""


class FileError(ShipwakeError, OSError):
    """A file or folder cannot be read or written."""


class TooLargeError(ShipwakeError, MemoryError):
    """An image or a result would not fit in memory."""


class ModelError(ShipwakeError, RuntimeError):
    """A network's numbers are not finite, or the device computes wrong numbers."""


class InternalError(ShipwakeError, RuntimeError):
    """A defect of this package. Please report its text."""
