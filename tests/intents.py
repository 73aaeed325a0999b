"""Intents for tests: short builders, and what the wishes of the stand-in's tests ask for."""

import re
from functools import cache
from typing import Any

from augment.fake_llm.sight import same_text
from augment.scene import intent as wish
from augment.scene.entities import Scene
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry, shown_scene
from tests.scenes import scene

LEFT_EDGE, RIGHT_EDGE = wish.LateralTarget.LEFT_BOUNDARY, wish.LateralTarget.RIGHT_BOUNDARY


def metres(low_m: float, high_m: float | None = None, *, about: bool = False) -> wish.Length:
    return wish.Length(
        low_m=low_m, high_m=low_m if high_m is None else high_m, is_approximate=about
    )


def spot(
    ahead_m: float,
    *settings: wish.Setting,
    lane: wish.LaneChoice | None = wish.LaneChoice.OWN,
    lateral: wish.Lateral | None = None,
    about: bool = False,
) -> wish.Spot:
    """So far ahead of the ego; behind it where that is negative."""
    return wish.Spot(
        distance=metres(abs(ahead_m), about=about),
        relation=wish.Relation.AHEAD if ahead_m >= 0.0 else wish.Relation.BEHIND,
        lane=lane,
        lateral=lateral,
        settings=settings,
    )


def towards(
    target: wish.LateralTarget, offset_m: float | None = None, how: wish.Nearness | None = None
) -> wish.Lateral:
    offset = None if offset_m is None else metres(offset_m)
    return wish.Lateral(target=target, offset=offset, nearness=how)


CENTRED = towards(wish.LateralTarget.LANE_CENTRE)


def parked(ahead_m: float = 21.4, *, body: wish.Body = wish.Body.CAR, **where: Any) -> wish.Intent:
    """One vehicle that stands, or several."""
    names = ("facing", "speed_mps", "turn_deg", "count", "spacing")
    what = {name: where.pop(name) for name in names if name in where}
    what = {"speed_mps": 0.0, "count": 1} | what
    request = wish.VehicleRequest(spot=spot(ahead_m, **where), body=body, **what)
    return wish.Intent(requests=(request,))


def walk(
    ahead_m: float, start: wish.Side | None, *settings: wish.Setting, **what: Any
) -> wish.Intent:
    """Somebody crosses from that side."""
    request = wish.WalkRequest(
        spot=spot(ahead_m, *settings, lane=None), start=start, **{"count": 1, **what}
    )
    return wish.Intent(requests=(request,))


def cones(
    ahead_m: float,
    count: int,
    shape: wish.Shape,
    *,
    lateral: wish.Lateral | None = None,
    **what: Any,
) -> wish.Intent:
    """Cones in a shape."""
    request = wish.ConesRequest(
        spot=spot(ahead_m, lateral=lateral), shape=shape, count=count, **what
    )
    return wish.Intent(requests=(request,))


def crash(ahead_m: float, count: int, *others: wish.CrashedCar, settings: Any = ()) -> wish.Intent:
    """Crashed cars."""
    request = wish.CrashRequest(spot=spot(ahead_m, *settings), count=count, others=others)
    return wish.Intent(requests=(request,))


PAPER = parked(
    body=wish.Body.VEHICLE,
    about=True,
    lateral=wish.Lateral(target=LEFT_EDGE, offset=metres(0.0, 1.5)),
)
"""The paper's own example: a parked vehicle 21.4 m ahead, towards the left lane boundary."""

_WISH = re.compile(r"Add a parked (car|vehicle) ([0-9.]+) m ahead(?: of the ego in its lane)?\.")


CONE = "Place a traffic cone on the ego's lane 20 m in front of the ego."


def known(instruction: str) -> list[tuple[Scene, wish.Intent]]:
    """The stand-in's list in tests: the catalogue, and the one wish that tests make."""
    found = _WISH.fullmatch(instruction)
    if found:
        return [(scene(), parked(float(found[2]), body=wish.Body(found[1])))]
    if instruction == CONE:
        return [(scene(), cones(20.0, 1, wish.Shape.LINE))]
    shelved = [entry(slug) for slug in _catalogue().get(instruction, ())]
    return [(shown_scene(one.slug), one.intent) for one in shelved if one.intent is not None]


@cache
def _catalogue() -> dict[str, list[str]]:
    slugs = (*SLUGS, *HARD_SLUGS)
    return {same_text(entry(slug).instruction): [slug] for slug in slugs}
