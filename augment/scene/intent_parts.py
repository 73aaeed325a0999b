"""Parts that an intent's requests share: sides, places, lengths, and what motion is asked for.

Left and right are those of the ego's direction of travel.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Annotated, Self, TypeVar

from numpy.random import Generator
from pydantic import Field, model_validator

from augment.scene.planned_motion import MotionPreset
from augment.scene.presets import preset_numbers
from augment.scene.schema import LabelEnum, Real, Yes

_Metres = Annotated[Real, Field(ge=0.0, le=1000.0)]
_Value = Annotated[Real, Field(ge=0.0, le=100.0)]
_ABOUT_SHARE = 0.05
""""About 20 m" is 19 to 21 m: a number that is rounded."""


class Side(StrEnum):
    """A side of the ego's direction of travel."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def other(self) -> Side:
        """The opposite side."""
        return Side.RIGHT if self is Side.LEFT else Side.LEFT

    @property
    def sign(self) -> float:
        """Sign of numbers to that side: left is positive."""
        return 1.0 if self is Side.LEFT else -1.0


class Aim(LabelEnum):
    """Type of an open wish, by its purpose."""

    HIDE = "hide_pedestrian", "Hide a pedestrian until late"
    LEAVE_WAY = "leave_narrow_way", "Leave one narrow way past"
    FORCE_BRAKING = "force_braking", "Make the ego brake hard"


class MapPlace(StrEnum):
    """A place of the map on the ego's route; a merge is a junction too."""

    JUNCTION_START = "start of the junction"
    JUNCTION_END = "end of the junction"
    CROSSWALK = "crosswalk"


class Setting(StrEnum):
    """A named place: what the surroundings must be."""

    BEFORE_INTERSECTION = "before the intersection"
    IN_INTERSECTION = "in the intersection"
    AT_INTERSECTION = "at the intersection"
    AFTER_INTERSECTION = "past the intersection"
    IN_BEND = "in the bend"
    ON_CROSSWALK = "on the crosswalk"
    OFF_CROSSWALK = "away from the crosswalk"
    BY_PARKED = "beside parked vehicles"
    BY_PARKED_LEFT = "between parked vehicles on the left"
    BY_PARKED_RIGHT = "between parked vehicles on the right"


def _fill_high(document: object) -> object:
    """In a document the low end alone is one number."""
    for low, high in (("low_m", "high_m"), ("low", "high")):
        if isinstance(document, dict) and low in document and document.get(high) is None:
            return document | {high: document[low]}
    return document


_Range = TypeVar("_Range", "Length", "Amount")


def _check_order(span: _Range) -> _Range:
    low, high = fields(span)[:2]
    if getattr(span, high.name) < getattr(span, low.name):
        raise ValueError(f"{high.name} is below {low.name}")
    return span


@dataclass(frozen=True, slots=True, kw_only=True)
class Length:
    """A length or a range of lengths in metres; `is_approximate` if the sentence says "about"."""

    low_m: _Metres
    high_m: _Metres
    is_approximate: Yes = False

    _takes_one_number = model_validator(mode="before")(_fill_high)
    _is_ordered = model_validator(mode="after")(_check_order)

    @property
    def is_range(self) -> bool:
        """True if a value has to be drawn from it."""
        return self.high_m > self.low_m

    @property
    def span_m(self) -> tuple[float, float]:
        """From where to where it may be; "about" leaves as much open at either end."""
        about_m = _ABOUT_SHARE * self.high_m if self.is_approximate else 0.0
        return self.low_m - about_m, self.high_m + about_m

    def draw(self, rng: Generator) -> float:
        """Return a length of the range, evenly drawn."""
        return float(rng.uniform(self.low_m, self.high_m))

    def __str__(self) -> str:
        about = "about " if self.is_approximate else ""
        if self.is_range:
            return f"{about}{self.low_m:g} to {self.high_m:g} m"
        return f"{about}{self.low_m:g} m"


@dataclass(frozen=True, slots=True, kw_only=True)
class Amount:
    """A number or a range of numbers; its unit is in the name of the field that holds it."""

    low: _Value
    high: _Value

    _takes_one_number = model_validator(mode="before")(_fill_high)
    _is_ordered = model_validator(mode="after")(_check_order)

    def draw(self, rng: Generator) -> float:
        """Return a number of the range, evenly drawn."""
        return float(rng.uniform(self.low, self.high))

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g}" if self.high > self.low else f"{self.low:g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class StartWish:
    """When a motion begins: at a moment, or as soon as the ego is somewhere.

    Attributes:
        after_s: Since t0.
        ego_distance: Of the ego from who moves, or from the mark where one is named.
        mark: A place of the map that the ego comes to; without a distance it is there.
        may_end: The sentence may as well say when the motion is over.
    """

    after_s: Amount | None = None
    ego_distance: Length | None = None
    mark: MapPlace | None = None
    may_end: Yes = False

    @model_validator(mode="after")
    def _says_when(self) -> Self:
        by_ego = self.ego_distance is not None or self.mark is not None
        if by_ego is (self.after_s is not None):
            raise ValueError("a start is after_s, or an ego_distance, a mark or both")
        return self

    def __str__(self) -> str:
        if self.after_s is not None:
            return f"after {self.after_s} s"
        where = f"the {self.mark}" if self.mark else "it"
        if self.ego_distance is None:
            return f"once the ego is at {where}"
        return f"once the ego is {self.ego_distance} from {where}"


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionWish:
    """Motion after t0, by its name in the sentence.

    Attributes:
        start: When; open where nobody says.
        side: From which side it comes over the junction, for a red light that is run.
        speed_mps: That it comes to.
        braking_mps2: How hard it brakes, positive.
        duration_s: How long a lane change takes, or the opening of a door.
    """

    preset: MotionPreset
    start: StartWish | None = None
    side: Side | None = None
    speed_mps: Amount | None = None
    braking_mps2: Amount | None = None
    duration_s: Amount | None = None

    @model_validator(mode="after")
    def _has_the_numbers_of_its_preset(self) -> Self:
        own = preset_numbers(self.preset)
        for name in ("speed_mps", "braking_mps2", "duration_s"):
            amount = getattr(self, name)
            if amount is not None and name not in own:
                raise ValueError(f"{name} is none of the numbers of {self.preset}: {own}")
            if amount is not None and name != "speed_mps" and amount.low == 0.0:
                raise ValueError(f"{name} is more than 0")
        if self.side is not None and self.preset is not MotionPreset.RED_LIGHT:
            raise ValueError("only who runs a red light comes from a side")
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class Purpose:
    """What a change is for, as windows in which what is measured of it has to lie.

    Attributes:
        sight: How near the ego is to a pedestrian, hidden at first, when it first sees it.
        passage: How wide the widest way past is that the road has left.
        braking_mps2: The hardest braking that each planner, which must not crash, is forced to.
        ttc_s: The least time to collision of each planner, which must not crash.
    """

    sight: Length | None = None
    passage: Length | None = None
    braking_mps2: Amount | None = None
    ttc_s: Amount | None = None

    @model_validator(mode="after")
    def _has_a_window(self) -> Self:
        if self == Purpose():
            raise ValueError("a purpose has a window: sight, passage, braking_mps2 or ttc_s")
        return self
