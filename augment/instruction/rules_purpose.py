"""Rules about what the ego is meant to do: read so that they are not mistaken, placing nothing."""

from __future__ import annotations

from augment.instruction.facts import Purpose
from augment.instruction.phrases import means, phrases

_MUST = "must|should|shall|can|needs|need|has|have|will|is"
_ACT = "nudge|overtake|pass|avoid|steer|swerve|drive|go|get|brake|stop|yield|evade"
_ROUND = "around|round|past|by|for"
_IT = "it|them|him|her|obstacle"

PURPOSE = phrases(
    means((Purpose(),)),
    f"so? that? <ego> {_MUST} forced|only? to? {_ACT} {_ROUND}? {_IT}?",
    f"forcing|making|causing <ego> to? {_ACT} {_ROUND}? {_IT}?",
    f"for <ego> to {_ACT} {_ROUND}? {_IT}?",
    f"so? that? {_IT} can|must|has only? to? be overtaken|passed|avoided",
    "through|using|via|into|over <oncoming>",
    "by using|driving|going|changing through|into|over|to? <oncoming>",
)

PURPOSE_RULES = {"purpose": PURPOSE}
