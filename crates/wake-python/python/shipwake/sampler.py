"""Images from sentences, by a small diffusion model whose weights come with the package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from . import _check, _core
from .errors import OptionError
from .labels import Labels
from .scene import Scene
from .simulation import _write, levels

__all__ = ["Sample", "Sampler"]


@dataclass(frozen=True, eq=False)
class Sample:
    """An image that a :class:`Sampler` draws. Images are ``[rows, columns]``."""

    scene: Scene
    """What was drawn: the values of the prompt, and default values of the rest."""
    grey: npt.NDArray[np.float32] = field(repr=False)
    """Grey 0 to 1 as the model draws it, without speckle."""
    intensity: npt.NDArray[np.float32] = field(repr=False)
    """Intensity of the same, linear, in the unit of the normalized radar cross-section."""
    speckled: npt.NDArray[np.float32] = field(repr=False)
    """Intensity with speckle: the image."""
    labels: Labels = field(repr=False)
    """Where ships and wakes are."""
    scale: dict[str, Any] = field(repr=False)
    """Mapping between intensity and grey."""
    seconds: float = field(repr=False)
    """Computing time of the batch [s]."""

    def levels(self) -> npt.NDArray[np.uint8]:
        """The image with speckle as grey of 8 bits."""
        return levels(self.speckled, self.scale)

    def _repr_png_(self) -> bytes:
        return _core.png(self.levels())

    def write_png(self, path: Any) -> None:
        """Writes the image with speckle as a grey PNG of 8 bits."""
        _write(path, self._repr_png_())


class Sampler:
    """Draws radar images of ship wakes from sentences and scenes.

    >>> from shipwake import Sampler
    >>> sample = Sampler.pretrained().sample("a ship at 8 m/s toward 135 degrees, wind 5 m/s", seed=7)
    >>> sample.levels().shape, sample.scene["ship.speed"]
    ((256, 256), 8.0)
    """

    __slots__ = ("_arguments", "_inner")

    _inner: _core.Sampler
    _arguments: tuple[str | None, int, Literal["both", "words", "numbers"]]

    def __init__(self) -> None:
        raise TypeError("load a sampler with Sampler.pretrained() or Sampler.from_folder(path)")

    @classmethod
    def pretrained(cls, *, steps: int = 3, mode: Literal["both", "words", "numbers"] = "both") -> Sampler:
        """The model of this package.

        Args:
            steps: Steps from noise to image, 1 to 1000.
            mode: What the model reads of a prompt: its words, the numbers that the parser finds, or the numbers and
                where it leaves words unread also those (``"both"``).
        """
        return cls._load(None, steps, mode)

    @classmethod
    def from_folder(
        cls, folder: Any, *, steps: int = 3, mode: Literal["both", "words", "numbers"] = "both"
    ) -> Sampler:
        """The model of a folder that ``wake train`` wrote.

        Raises:
            FileError: A file that is not there or cannot be read.
            WeightsError: Files that do not fit each other.
        """
        return cls._load(_check.path("folder", folder), steps, mode)

    @classmethod
    def _load(cls, folder: str | None, steps: int, mode: Literal["both", "words", "numbers"]) -> Sampler:
        sampler = cls.__new__(cls)
        steps = _check.whole("steps", steps, 1, 1000)
        sampler._arguments = (folder, steps, mode)
        sampler._inner = _core.Sampler.load(folder, steps, _check.text("mode", mode), None)
        return sampler

    def base_scene(self) -> Scene:
        """The scene from which the values come that a prompt leaves open."""
        return Scene._of(self._inner.base_scene())

    @overload
    def sample(self, prompt: str | Scene, seed: int = 7, *, threads: int | None = None) -> Sample: ...
    @overload
    def sample(
        self, prompt: list[str] | list[Scene], seed: int = 7, *, threads: int | None = None
    ) -> list[Sample]: ...
    def sample(
        self,
        prompt: str | Scene | list[str] | list[Scene],
        seed: int = 7,
        *,
        threads: int | None = None,
    ) -> Sample | list[Sample]:
        """An image of a prompt or a scene, or of each of several in one batch.

        Args:
            prompt: A sentence, a :class:`Scene`, or a list of either.
            seed: Seed of the sea and of the speckle; prompt k of a list has ``seed + k``. A scene has its own seed.
            threads: Number of threads, by default one a core.

        Raises:
            PromptError: A prompt that states nothing of a scene, or contradicts itself.
            OptionError: A scene that the model was not trained for.
        """
        several = [prompt] if isinstance(prompt, str | Scene) else list(prompt)
        pool = _check.threads(threads)
        if several and all(isinstance(one, Scene) for one in several):
            cores = [one._inner for one in several if isinstance(one, Scene)]
            made = self._inner.scenes(cores, pool)
        elif all(isinstance(one, str) for one in several):
            first = _check.whole("seed", seed, 0, _check.LARGEST_SEED)
            made = self._inner.prompts([_check.text("prompt", one) for one in several], first, pool)
        else:
            raise OptionError("a batch holds prompts or scenes, not both")
        samples = [_sample(one) for one in made]
        return samples[0] if isinstance(prompt, str | Scene) else samples

    def __reduce__(self) -> tuple[Any, ...]:
        return Sampler._load, self._arguments


def _sample(one: Mapping[str, Any]) -> Sample:
    return Sample(
        scene=Scene._of(one["scene"]),
        grey=one["grey"],
        intensity=one["intensity"],
        speckled=one["speckled"],
        labels=Labels._of(one["labels"]),
        scale=one["scale"],
        seconds=one["seconds"],
    )
