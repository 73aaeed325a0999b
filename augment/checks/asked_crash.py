"""How crashed vehicles lie to each other, against what is said of them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.asked import Asked, facing_words, severity_of, side_of
from augment.checks.crash_order import Pair, in_order, pairs
from augment.checks.finding import Finding, FindingKind
from augment.checks.tolerances import CRASH_M, USUAL
from augment.geometry.angles import difference
from augment.scene.entities import TrafficAgent
from augment.scene.intent import (
    CrashRequest,
    LaneChoice,
)
from augment.scene.intent_words import (
    Facing,
)


def asked_crash(asked: Asked) -> Iterator[Finding]:
    """Angles (heading) and gaps (position) between neighbours, and a first one that lies across.

    Nothing is found where the number of vehicles is wrong or where they lie on each other, which
    are faults of their own: then nobody knows which of them is which.
    """
    for party in asked.parties:
        request = party.request
        if not isinstance(request, CrashRequest) or not party.is_exact:
            continue
        order = in_order(party, request, asked.route)
        in_pairs = pairs(order, request)
        if any(pair.gap_m < pair.one.width_m for pair in in_pairs):
            continue
        if request.facing not in (None, Facing.WITH_LANE):
            yield from _facing(asked, request, order[0])
        for pair in in_pairs:
            yield _gap(pair, asked)
            if pair.off_deg is not None:
                yield _turn(pair, asked)


def _turn(pair: Pair, asked: Asked) -> Finding:
    asked_deg, off_deg = pair.asked.turn_deg or 0.0, pair.off_deg or 0.0
    side = f" to the {side_of(asked_deg)}" if pair.asked.is_signed else ""
    return Finding(
        kind=FindingKind.ASKED_HEADING,
        severity=severity_of(fits=off_deg <= asked.tolerances.heading_deg),
        agents=(pair.other.id, pair.one.id),
        measured={"turn_deg": pair.turn_deg, "asked_deg": asked_deg, "off_deg": off_deg},
        template=(
            "{agents[0]} is turned {turn_deg:.0f} degrees against {agents[1]}; {asked_deg:.0f} "
            f"degrees{side} are asked for."
        ),
    )


def _gap(pair: Pair, asked: Asked) -> Finding:
    """As far apart as said, else near enough to have run into each other."""
    wanted = pair.asked.gap
    longest_m = max(CRASH_M, pair.one.length_m, pair.other.length_m)
    if wanted is None:
        fits = pair.gap_m <= longest_m
        words = "vehicles that have crashed are within {asked_m:.1f} m"
        asked_m = longest_m
    else:
        allowed_m = max(asked.tolerances.spacing_m, asked.tolerances.spacing_share * wanted.high_m)
        fits = (pair.off_m or 0.0) <= allowed_m
        words = "{asked_m:.1f} m is asked for"
        asked_m = (wanted.low_m + wanted.high_m) / 2.0
    return Finding(
        kind=FindingKind.ASKED_SPACING,
        severity=severity_of(fits=fits),
        agents=(pair.other.id, pair.one.id),
        measured={"gap_m": pair.gap_m, "asked_m": asked_m},
        template=f"{{agents[0]}} is {{gap_m:.1f}} m from {{agents[1]}}; {words}.",
    )


def _facing(asked: Asked, request: CrashRequest, first: TrafficAgent) -> Iterator[Finding]:
    band = asked.lanes.band(request.spot.lane or LaneChoice.OWN, asked.ahead_m(first))
    if band is None:
        return
    turn_deg = abs(math.degrees(difference(first.heading_rad, band.tangent_rad)))
    wanted_deg = 90.0 if request.facing is Facing.ACROSS else 180.0
    yield Finding(
        kind=FindingKind.ASKED_HEADING,
        severity=severity_of(fits=abs(turn_deg - wanted_deg) <= _ROUGHLY_DEG),
        agents=(first.id,),
        measured={"turn_deg": turn_deg, "asked_deg": wanted_deg},
        template=(
            "{agents[0]} is turned {turn_deg:.0f} degrees from its lane; "
            f"{facing_words(request.facing)} is asked for."
        ),
    )


_ROUGHLY_DEG = 2.0 * USUAL.heading_deg
"""A car that has spun stands "crosswise" only roughly."""
