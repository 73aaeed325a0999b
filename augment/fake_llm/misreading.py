"""How the careless stand-in misreads what a sentence asks for, before it places anything.

Only what the paper set hardly asks for is misread here: who or what a distance runs from, where
the ego turns, several groups, a move or a removal, a wish that can't be met. On the paper set
that changes the ten roadworks alone, whose sign and barrier are counted from the first cone.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

from augment.scene.entities import TurnType
from augment.scene.intent import Body, Intent, LaneChoice, Length, Relation, Spot, VehicleRequest

_ATTEMPT_SHARE = 0.6
"""So many of the wishes that can't be met are carried out somehow."""
_ATTEMPT_M = 20.0
_LEVEL_M = 8.0
"""What stands for no distance at all."""


def misread(intent: Intent, rng: random.Random) -> Intent:
    """The intent as a careless reader has it: with one mistake wherever one can be made."""
    possible = [misreading for slip in SLIPS if (misreading := slip(intent)) is not None]
    if not possible or (intent.unmet and rng.random() > _ATTEMPT_SHARE):
        return intent
    return rng.choice(possible)


def try_anyway(intent: Intent) -> Intent | None:
    """What can't be met is done somehow: a car stands ahead."""
    if not intent.unmet:
        return None
    ahead = Length(low_m=_ATTEMPT_M, high_m=_ATTEMPT_M)
    spot = Spot(distance=ahead, relation=Relation.AHEAD, lane=LaneChoice.OWN)
    return Intent(requests=(VehicleRequest(spot=spot, body=Body.CAR, speed_mps=0.0, count=1),))


def go_straight(intent: Intent) -> Intent | None:
    """The turn is passed over; distances run straight on."""
    if intent.route is TurnType.STRAIGHT:
        return None
    return replace(intent, route=TurnType.STRAIGHT)


def turn_the_other_way(intent: Intent) -> Intent | None:
    """Left is taken for right, or right for left."""
    others = {TurnType.LEFT: TurnType.RIGHT, TurnType.RIGHT: TurnType.LEFT}
    other = others.get(intent.route)
    return None if other is None else replace(intent, route=other)


def count_from_ego(intent: Intent) -> Intent | None:
    """Whatever a distance runs from, it is taken from the ego."""
    if not any(_is_relative(one.spot) for one in (*intent.requests, *intent.moves)):
        return None
    return replace(
        intent,
        requests=tuple(replace(one, spot=_from_ego(one.spot)) for one in intent.requests),
        moves=tuple(replace(one, spot=_from_ego(one.spot)) for one in intent.moves),
    )


def take_first(intent: Intent) -> Intent | None:
    """The first road user of its kind is taken for a later one."""
    picks = [one.spot.landmark for one in intent.requests]
    if not any(pick is not None and pick.ordinal > 1 for pick in picks):
        return None
    return replace(
        intent,
        requests=tuple(
            one
            if one.spot.landmark is None
            else replace(
                one, spot=replace(one.spot, landmark=replace(one.spot.landmark, ordinal=1))
            )
            for one in intent.requests
        ),
    )


SLIPS: tuple[Callable[[Intent], Intent | None], ...] = (
    try_anyway,
    go_straight,
    turn_the_other_way,
    count_from_ego,
    take_first,
)


# Private


def _is_relative(spot: Spot) -> bool:
    return spot.landmark is not None or spot.mark is not None or spot.anchor is not None


def _from_ego(spot: Spot) -> Spot:
    if not _is_relative(spot):
        return spot
    near = Length(low_m=_LEVEL_M, high_m=_LEVEL_M)
    bare = replace(spot, anchor=None, landmark=None, mark=None, settings=())
    return replace(bare, distance=spot.distance or near, relation=Relation.AHEAD)
