"""Rules about where across the lane: offsets, boundaries, the shoulder."""

from __future__ import annotations

from augment.instruction.facts import Fact, Offset, Shoulder, Towards
from augment.instruction.intent import LateralTarget, Length, Nearness, Side
from augment.instruction.phrases import Found, means, phrases

_SLIGHT = "slight|small|little"
_SLIGHTLY = "slightly|somewhat"
_OFF = "offset|shifted|displaced|pulled|moved|set|standing|parked|positioned|off|located|stands"
_MOVED = "offset|shifted|displaced|pulled|moved"
_LAID = "runs|run|running|placed|arranged|set|lined|follows|stretching|stretches"
_PAVEMENT = "pavement|sidewalk|walkway|footpath|footway"
_FROM = "from|to|off|beside|of"


def _offset(found: Found) -> tuple[Fact, ...]:
    return (Offset(found.get("length", Length)),)


def _target(side: Side) -> LateralTarget:
    return LateralTarget.LEFT_BOUNDARY if side is Side.LEFT else LateralTarget.RIGHT_BOUNDARY


def _to_side(found: Found) -> tuple[Fact, ...]:
    length, boundary = found.maybe("length", Length), found.maybe("boundary", LateralTarget)
    side = found.maybe("side", Side)
    targets = [Towards(_target(side))] if side else []
    targets += [Towards(boundary)] if boundary else []
    return (*targets, *(() if length is None else (Offset(length),)))


OFFSET = (
    phrases(
        _offset,
        f"with|at? {_SLIGHT}? lateral|sideways? offset of|by? anything|somewhere? randomly? "
        "<length>",
        f"with|at? {_SLIGHT}? lateral|sideways? offset of|by? anything|somewhere? randomly? "
        f"<length> {_FROM} <centre>",
        "<length> offset",
        f"<length> offset {_FROM} <centre>",
        f"at? <length> away? {_FROM} <centre>",
        f"{_MOVED} over|out? by? <length>",
        f"{_MOVED} over|out? by? <length> {_FROM} <centre>",
        f"with its? centre|center|middle <length> {_FROM} <centre>",
        f"centre|center is|stands? <length> {_FROM} <centre>",
        f"distance of? <length> {_FROM} <centre>",
    )
    + phrases(
        _to_side,
        f"{_SLIGHTLY}? to|on? <side> of <centre>",
        "<length> to|on? <side> of <centre>",
        "<length> to|on? <side> of <centre> , ( <boundary>",
        f"{_OFF} over|out? by|to? <length> to|towards|toward <side>",
        f"{_OFF} to|towards|toward <side> by <length>",
        f"{_OFF} to|towards|toward <side> of <centre> by <length>",
        f"{_OFF} to|towards|toward|on? <side> side? by <length>",
        f"{_OFF} by? <length> to|on? <side> of <centre>",
        "<length> over|off|out? to|on|towards|toward? <side> of|from <centre>",
        "<length> over|off|out to|towards|toward <side>",
        f"{_OFF} over|out? by? <length> to|towards|toward|on? <side> of|from <centre>",
        "<length> <side> of|from <centre>",
        "<length> to|on <side> side of <centre>",
        "with? <length> offset|shift to|towards|toward <side> of|from? <centre>?",
        "with? lateral|sideways? offset|shift|displacement of <length> to|towards|toward <side>",
        "with? lateral|sideways? offset|shift|displacement of <length> to|towards|toward <side> "
        "of|from <centre>",
        "with? <side> offset|shift of <length> from|to|of? <centre>?",
        "<length> to <side>",
        "<length> towards|toward <side>",
        f"at? <length> away? {_FROM} <centre> to|towards|toward|on <side> side?",
        f"at? <length> away? {_FROM} <centre> to|towards|toward|on|at <boundary>",
        f"{_OFF} by? <length> {_FROM} <centre> to|towards|toward|on <side> side?",
        f"{_OFF} by? <length> {_FROM} <centre> to|towards|toward|on|at <boundary>",
        "<length> towards|toward|on <boundary>",
        f"{_OFF} over|out? by? <length> to|towards|toward|onto <boundary>",
        f"{_OFF} to|towards|toward <boundary> by <length>",
    )
    + phrases(
        means((Offset(None),)),
        f"with|at? {_SLIGHT} lateral? offset",
        f"with|at? {_SLIGHT} lateral? offset {_FROM} <centre>",
        f"{_SLIGHTLY} offset",
        f"{_SLIGHTLY} offset {_FROM} <centre>",
        f"offset {_FROM} <centre>",
        f"{_SLIGHTLY} off <centre>",
    )
)


TOWARDS = (
    phrases(
        lambda found: (Towards(found.get("boundary", LateralTarget)),),
        f"{_OFF}? towards|toward|to <boundary>",
        "towards|toward <boundary:plain>",
        f"{_OFF} towards|toward|to <boundary:plain>",
        "measured? in direction of <boundary>",
    )
    + phrases(
        lambda found: (Towards(found.get("boundary", LateralTarget), Nearness.SLIGHTLY),),
        f"{_SLIGHTLY} {_OFF}? towards|toward|to <boundary>",
        f"{_SLIGHTLY} {_OFF}? towards|toward|to <boundary:plain>",
        f"with? {_SLIGHT} offset towards|toward|to <boundary>",
        f"with? {_SLIGHT} offset towards|toward|to <boundary:plain>",
        f"bit|little {_OFF}? towards|toward|to <boundary>",
        f"bit|little {_OFF}? towards|toward|to <boundary:plain>",
        f"{_OFF} {_SLIGHTLY} towards|toward|to <boundary>",
        f"{_OFF} {_SLIGHTLY} towards|toward|to <boundary:plain>",
    )
    + phrases(
        lambda found: (Towards(found.get("boundary", LateralTarget), Nearness.AT_EDGE),),
        "right|directly? at|along|by|near|on|against <boundary>",
        f"{_LAID} along|on|at <boundary>",
        "next|close|tight to <boundary>",
        "hugging|touching|lining|following|line|lines|follow|mark|marks|marking <boundary>",
        "close|tight|hard|right|flush|snug up? against|by|to|with <boundary>",
        "alongside|beside <boundary>",
        "touches|abutting|abuts <boundary>",
    )
    + phrases(
        lambda found: (Towards(found.get("boundary", LateralTarget), Nearness.AT_EDGE),),
        "( <boundary:plain> )",
        "( on|to? <boundary:plain> side? )",
    )
    + phrases(
        means((Towards(LateralTarget.KERB, Nearness.AT_EDGE),)),
        f"right|directly? next|close|tight to {_PAVEMENT}",
        f"right|directly? by|along|alongside|beside|near|at {_PAVEMENT}",
        f"hugging|touching|lining {_PAVEMENT}",
    )
    + phrases(
        lambda found: (Towards(_target(found.get("side", Side)), Nearness.AT_EDGE),),
        f"right|directly? next|close|tight to <side> {_PAVEMENT}",
        f"right|directly? along|alongside|beside <side> {_PAVEMENT}",
    )
)

SHOULDER = phrases(
    lambda found: (Shoulder(found.maybe("side", Side), Nearness.HALF_OUT),),
    "partly|partially|half|halfway on|onto|over <side>? hard? shoulder",
    "partly|partially|half|halfway on|onto|over|up? on? <side>? <walkway>",
    "with two wheels on|up? on? <side>? hard? shoulder",
    "with? half of it on|over|onto <side>? hard? shoulder",
    "with? half of it on|over|onto <side>? <walkway>",
    "half on half off <side>? <walkway>",
    "with two wheels on|up? on? <side>? <walkway>",
) + phrases(
    lambda found: (Shoulder(found.maybe("side", Side), Nearness.OUTSIDE),),
    "completely|fully|entirely|wholly? on|onto <side>? hard? shoulder",
)

SIDE_RULES = {
    "offset": OFFSET,
    "side of the lane": TOWARDS,
    "shoulder": SHOULDER,
}
