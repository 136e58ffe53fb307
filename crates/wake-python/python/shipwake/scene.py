"""Scenes: ships, sea and radar over a grid of pixels."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, TypeAlias

from . import _check, _core
from .errors import OptionError, UnknownKeyError
from .labels import Labels
from .plan import Plan

__all__ = ["Scene", "Wording"]

Wording: TypeAlias = Literal["paper", "wind-first", "radar-first", "brief"]
"""Wordings of the prompt of a scene."""

_WORDINGS: tuple[str, ...] = ("paper", "wind-first", "radar-first", "brief")
_DEFAULT_SHIP: Mapping[str, Any] = {}


class Scene:
    """Ships, sea and radar over a grid of pixels, to be simulated.

    Each table holds the keys of a scene file in SI units and degrees; absent keys have their default values, and unknown keys
    are errors. Scenes are immutable; :meth:`with_values` returns a new one.

    >>> from shipwake import Scene
    >>> scene = Scene(ship={"speed": 8, "heading": 90}, sea={"wind_speed": 3}, grid={"rows": 64, "columns": 64})
    >>> scene["ship.speed"], scene["sea.wind_speed"]
    (8.0, 3.0)
    >>> Scene(ship={"speed": 80})
    Traceback (most recent call last):
        ...
    shipwake.errors.SceneError: ship.speed is 80, outside 0 to 40 m/s

    Args:
        ship: One ship, a list of ships, or ``None`` for open sea; by default one default ship.
        sea: Wind and waves.
        radar: The radar and its platform; ``{"sensor": "sentinel-1-iw"}`` sets the values of a satellite.
        grid: Rows, columns and spacing of the pixels.
        model: Terms of the physics that are computed, and their tolerance.
        seed: Seed of the random sea and of the speckle, 0 to 2**64 - 1.

    Raises:
        SceneError: A value out of its range, or an unknown key.
        TypeError: A value that a scene file cannot hold.
    """

    __slots__ = ("_inner", "_tables")

    _inner: _core.Scene
    _tables: dict[str, Any] | None

    def __init__(
        self,
        *,
        ship: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = _DEFAULT_SHIP,
        sea: Mapping[str, Any] | None = None,
        radar: Mapping[str, Any] | None = None,
        grid: Mapping[str, Any] | None = None,
        model: Mapping[str, Any] | None = None,
        seed: int = 7,
    ) -> None:
        tables: dict[str, Any] = {"seed": _check.whole("seed", seed, 0, _check.LARGEST_SEED)}
        for name, table in (("sea", sea), ("radar", radar), ("grid", grid), ("model", model)):
            if table is not None:
                tables[name] = _table(name, table)
        if isinstance(ship, Mapping):
            tables["ship"] = _table("ship", ship)
        elif ship is not None:
            if isinstance(ship, str) or not isinstance(ship, Sequence):
                raise TypeError(f"ship is {ship!r:.80}, expected a dictionary, or a list of them")
            tables["ship"] = [_table(f"ship[{n}]", one) for n, one in enumerate(ship)]
        self._inner = _core.Scene.from_tables(tables)
        self._tables = None

    @classmethod
    def _of(cls, core: _core.Scene) -> Scene:
        scene = cls.__new__(cls)
        scene._inner = core
        scene._tables = None
        return scene

    @classmethod
    def from_toml(cls, text: str) -> Scene:
        """Reads the text of a scene file (TOML). Without a table ``[ship]`` there is no ship.

        >>> Scene.from_toml("[ship]\\nspeed = 8")["ship.speed"]
        8.0

        Raises:
            SceneError: Text that is not a scene file; the message names line and key.
        """
        return cls._of(_core.Scene.from_toml(_check.text("text", text)))

    @classmethod
    def read(cls, path: Any) -> Scene:
        """Reads a scene file.

        Raises:
            FileError: A file that cannot be read, or is not a scene file.
            SceneError: A value out of its range.
        """
        return cls._of(_core.Scene.read(_check.path("path", path)))

    @classmethod
    def from_prompt(cls, prompt: str, base: Scene | None = None) -> Scene:
        """Returns the scene that a prompt states. All other values are those of ``base``, by default the default scene.

        >>> scene = Scene.from_prompt("a ship at 8 m/s toward 135 degrees, wind 5 m/s")
        >>> scene["ship.speed"], scene["ship.heading"], scene["sea.wind_speed"]
        (8.0, 135.0, 5.0)

        Raises:
            PromptError: A prompt that states nothing of a scene, or contradicts itself.
        """
        onto = cls() if base is None else _scene("base", base)
        scene, _ = _core.Scene.from_prompt(_check.text("prompt", prompt), onto._inner)
        return cls._of(scene)

    def prompt(self, wording: Wording = "paper") -> str:
        """Returns the scene in words. With several ships, the prompt states speed and heading of the first.

        >>> Scene(ship=None).prompt("brief")
        'SAR open sea, no ship, wind 5 mps toward 90 degrees, fetch 40000 meter, incidence 32 degrees.'
        """
        if not isinstance(wording, str) or wording not in _WORDINGS:
            raise OptionError(f"wording is {wording!r:.80}, expected one of {', '.join(_WORDINGS)}")
        return self._inner.prompt(_WORDINGS.index(wording))

    def to_toml(self) -> str:
        """Returns the scene as the text of a scene file."""
        return self._inner.to_toml()

    def to_dict(self) -> dict[str, Any]:
        """Returns the tables of the scene, with every key that has a value; ``Scene(**scene.to_dict())`` is the same scene.

        Without a ship, ``ship`` is ``None``, while a file has no such key.
        """
        return copy.deepcopy(self._values())

    def _values(self) -> dict[str, Any]:
        if self._tables is None:
            tables = self._inner.to_tables()
            tables["seed"] = int(tables["seed"])
            tables.setdefault("ship", None)
            if tables["sea"]["depth"] == "infinite":
                tables["sea"]["depth"] = float("inf")
            self._tables = tables
        return self._tables

    def with_values(self, values: Mapping[str, Any] | None = None, /, **tables: Mapping[str, Any]) -> Scene:
        """Returns the scene with other values, by keys such as ``"ship.speed"`` or as tables.

        With several ships, the first is ``ship.1``. The number after the last adds a ship.

        >>> scene = Scene().with_values({"ship.speed": 6, "seed": 1}, sea={"wind_speed": 4})
        >>> scene["ship.speed"], scene["sea.wind_speed"]
        (6.0, 4.0)

        Raises:
            UnknownKeyError: A key that no scene has.
            SceneError: A value out of its range.
        """
        if not isinstance(values, Mapping | None):
            raise TypeError(f"values are {values!r:.80}, expected a dictionary such as {{'ship.speed': 8}}")
        changes = dict(values or {})
        for name, table in tables.items():
            if name == "seed":
                changes[name] = table
                continue
            changes.update((f"{name}.{key}", value) for key, value in _table(name, table).items())
        return self._of(self._inner.with_values(changes))

    def __getitem__(self, key: str) -> Any:
        """Returns the value of a key such as ``"ship.speed"``; with several ships, the first is ``ship.1``.

        Raises:
            UnknownKeyError: No such key, or a key without a value.
        """
        found: Any = self._values()
        for part in str(key).split("."):
            if isinstance(found, list) and part.isdecimal() and 1 <= int(part) <= len(found):
                found = found[int(part) - 1]
            elif isinstance(found, dict) and part == "1" and "1" not in found:
                pass
            elif isinstance(found, dict) and part in found:
                found = found[part]
            else:
                raise UnknownKeyError(f"the scene has no value of {str(key)!r:.80}; see the page of scene keys")
        return copy.deepcopy(found)

    def __iter__(self) -> Iterator[str]:
        raise TypeError("a Scene cannot be iterated; use to_dict()")

    def labels(self) -> Labels:
        """Returns the labels of the image without simulating it."""
        return Labels._of(self._inner.labels())

    def plan(self) -> Plan:
        """Returns the plan of the simulation, with its cost, without running it.

        Raises:
            TooLargeError: A grid that does not fit in memory.
        """
        return Plan._of(self._inner.plan())

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the image."""
        rows, columns, _ = self._inner.grid()
        return rows, columns

    @property
    def spacing(self) -> float:
        """Pixel size [m]."""
        return self._inner.grid()[2]

    @property
    def seed(self) -> int:
        """Seed of the random sea and of the speckle."""
        return int(self._values()["seed"])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self._inner.equals(other._inner)

    def __hash__(self) -> int:
        return hash(self._inner.to_toml())

    def __reduce__(self) -> tuple[Any, ...]:
        return Scene.from_toml, (self._inner.to_toml(),)

    def __repr__(self) -> str:
        rows, columns, spacing = self._inner.grid()
        return f"<Scene of {rows} x {columns} pixels of {spacing:g} m: {self.prompt('brief')}>"


def _table(name: str, table: Any) -> dict[str, Any]:
    if not isinstance(table, Mapping):
        raise TypeError(f"{name} is {table!r:.80}, expected a dictionary of its keys")
    return dict(table)


def _scene(name: str, scene: Any) -> Scene:
    if not isinstance(scene, Scene):
        raise TypeError(f"{name} is {scene!r:.80}, expected a Scene")
    return scene


