"""Programmed traffic lights: a cycle of colours, each so many steps long."""

from __future__ import annotations

from dataclasses import dataclass

from augment.formats.commonroad.network import fault, whole
from augment.formats.documents import Element
from augment.scene.entities import TrafficLight, TurnType

COLOURS = {
    "green": TrafficLight.GREEN,
    "yellow": TrafficLight.YELLOW,
    "red": TrafficLight.RED,
    "redYellow": TrafficLight.RED,
    "inactive": TrafficLight.UNKNOWN,
}
_DIRECTIONS = {TurnType.LEFT: "left", TurnType.RIGHT: "right", TurnType.STRAIGHT: "straight"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Light:
    """One light.

    Attributes:
        cycle: Colour and steps, in order.
        offset: The step at which the cycle begins.
        direction: "all", or words like "leftStraight".
    """

    cycle: tuple[tuple[TrafficLight, int], ...]
    offset: int
    direction: str
    is_active: bool

    def holds_for(self, turn: TurnType | None) -> bool:
        """Whether a way of that turn obeys this light."""
        if turn is None or self.direction in ("", "all") or turn not in _DIRECTIONS:
            return True
        return _DIRECTIONS[turn] in self.direction.lower()

    def state_at(self, step: int) -> TrafficLight:
        """The colour at a time step."""
        total = sum(duration for _, duration in self.cycle)
        if not self.is_active or total == 0:
            return TrafficLight.UNKNOWN
        place = (step - self.offset) % total
        for colour, duration in self.cycle:
            if place < duration:
                return colour
            place -= duration
        raise AssertionError("a place in a cycle lies in one of its parts")


def lights_of(root: Element) -> dict[int, Light]:
    """Every light by its id.

    Raises:
        InvalidDocument: A colour or a duration breaks the format.
    """
    lights = {}
    for element in root.all("trafficLight"):
        light_id = whole(element.attributes.get("id"), "trafficLight")
        place = f"trafficLight {light_id}"
        cycle = element.first("cycle")
        parts: list[tuple[TrafficLight, int]] = []
        offset = 0
        if cycle is not None:
            parts = [_part(one, place) for one in cycle.all("cycleElement")]
            given = cycle.first("timeOffset")
            offset = 0 if given is None else whole(given.text, f"{place}.timeOffset")
        direction, active = element.first("direction"), element.first("active")
        lights[light_id] = Light(
            cycle=tuple(parts),
            offset=offset,
            direction="" if direction is None else direction.text.strip(),
            is_active=active is None or active.text.strip() != "false",
        )
    return lights


def _part(element: Element, place: str) -> tuple[TrafficLight, int]:
    colour, duration = element.first("color"), element.first("duration")
    text = "" if colour is None else colour.text.strip()
    if text not in COLOURS:
        allowed = ", ".join(COLOURS)
        raise fault(place, f"unknown colour {text[:20]!r}; known: {allowed}")
    steps = whole(None if duration is None else duration.text, f"{place}.duration")
    if steps < 0:
        raise fault(place, f"a duration of {steps} steps is none")
    return COLOURS[text], steps
