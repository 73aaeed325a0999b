"""Rules about what the ego is meant to do: read so that they are not mistaken, placing nothing."""

from __future__ import annotations

from augment.instruction.facts import Purpose
from augment.instruction.phrases import means, phrases

_MUST = "has|have|must|needs|need|should|shall|will|can|could|may|might|would|wants|tries"
_ACT = (
    "squeeze|steer|manoeuvre|maneuver|edge|slip|ease|move|wait|"
    "nudge|overtake|pass|avoid|steer|swerve|drive|go|get|brake|stop|yield|evade"
)
_ROUND = "around|round|past|by|for"
_IT = "it|them|him|her|obstacle"

PURPOSE = phrases(
    means((Purpose(),)),
    f"<ego> {_MUST} to? {_ACT} {_ROUND}?",
    f"for <ego> to {_ACT} {_ROUND}? {_IT}?",
    f"so? that? {_IT} can|must|has only? to? be overtaken|passed|avoided",
    "through|using|via|over <oncoming>",
    "by using|driving|going|changing through|into|over|to? <oncoming>",
    f"we {_MUST} to? {_ACT} {_ROUND}?",
    "stays|remains|stay|remain",
    "overtake|pass through|using|via|over|on <oncoming>",
    "to block|obstruct road|way|lane|it?",
)

PURPOSE_RULES = {"purpose": PURPOSE}
