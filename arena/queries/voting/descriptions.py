"""The text description in words: what augment.render.legend gives as values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from django.utils.translation import get_language, gettext
from django.utils.translation import gettext_noop as _

_KINDS = {
    "EGO_VEHICLE": _("Vehicle"),
    "VEHICLE": _("Vehicle"),
    "BUS": _("Bus"),
    "BICYCLE": _("Bicycle"),
    "PEDESTRIAN": _("Pedestrian"),
    "TRAFFIC_CONE": _("Traffic cone"),
    "BARRIER": _("Barrier"),
    "CONSTRUCTION_SIGN": _("Construction sign"),
    "GENERIC_OBJECT": _("Object"),
}
_HEADINGS = {
    0: _("facing as the ego does"),
    90: _("facing left"),
    -90: _("facing right"),
    180: _("facing the opposite way"),
}
_ALONG = {0: _("lying lengthways"), 90: _("lying across")}
_FACING = (_("facing {}° to the left"), _("facing {}° to the right"))
_TURNED = (_("turned {}° to the left"), _("turned {}° to the right"))
_AHEAD = (_("{} m ahead"), _("{} m behind"))
_LEFT = (_("{} m left"), _("{} m right"))
_IN_LINE = _("in line with the ego")
_NOTHING, _GONE = _("Nothing was changed."), _("No longer there: {}")
_STANDS, _MOVES, _WALKS = _("standing"), _("moving at {} m/s"), _("walking to {}")
_ALL = (
    *(*_KINDS.values(), *_HEADINGS.values(), *_ALONG.values()),
    *(*_FACING, *_TURNED, *_AHEAD, *_LEFT, _IN_LINE, _NOTHING, _GONE, _STANDS, _MOVES, _WALKS),
)

Words = Mapping[str, str]


def describe_in_words(lines: Sequence[Mapping[str, Any]]) -> list[str]:
    """One sentence in the reader's language for each line, as they are kept with a matchup."""
    words = _words_in(get_language())
    return [_sentence(line, words) for line in lines] or [words[_NOTHING]]


# Private


@cache
def _words_in(language: str | None) -> Words:
    """All texts in the active language: looking one up is slow where a page describes many."""
    return {text: gettext(text) for text in _ALL}


def _sentence(line: Mapping[str, Any], words: Words) -> str:
    parts = [words[_KINDS[line["kind"]]], _place(line["ahead_m"], line["left_m"], words)]
    if line["heading_deg"] is not None:
        parts.append(_angle(line["heading_deg"], _HEADINGS, _FACING, words))
    if line["along_deg"] is not None:
        parts.append(_angle(line["along_deg"], _ALONG, _TURNED, words))
    if line["walk_to_m"]:
        ahead_m, left_m = line["walk_to_m"]
        parts.append(words[_WALKS].format(_place(ahead_m, left_m, words)))
    elif line["speed_mps"]:
        parts.append(words[_MOVES].format(f"{line['speed_mps']:.1f}"))
    elif line["speed_mps"] is not None:
        parts.append(words[_STANDS])
    said = ", ".join(parts)
    return words[_GONE].format(said) if line["change"] == "gone" else said


def _place(ahead_m: float, left_m: float, words: Words) -> str:
    ahead = words[_AHEAD[ahead_m < 0]].format(f"{abs(ahead_m):.1f}")
    side = words[_LEFT[left_m < 0] if left_m else _IN_LINE].format(f"{abs(left_m):.1f}")
    return f"{ahead}, {side}"


def _angle(degrees: int, named: Mapping[int, str], turns: tuple[str, str], words: Words) -> str:
    if degrees in named:
        return words[named[degrees]]
    return words[turns[degrees < 0]].format(abs(degrees))
