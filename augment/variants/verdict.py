"""What a review says about one round, whoever made it."""

from __future__ import annotations

from dataclasses import dataclass

from augment.scene.entities import Scene
from augment.scene.modification import Modification


@dataclass(frozen=True, slots=True, kw_only=True)
class Submission:
    """What is reviewed.

    Attributes:
        scene: The scene before the change.
        earlier: The modification of the round before, None in the first.
        told: What the modifier was told in the rounds before, in order.
    """

    scene: Scene
    instruction: str
    modification: Modification
    earlier: Modification | None = None
    told: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The outcome of one review.

    Attributes:
        is_accepted: Whether the rounds end here.
        score: The higher, the better; comparable within one run. Empty where nothing is scored.
        feedback: One entry a problem, for the modifier.
        is_measured: Whether these are measured facts rather than somebody's opinion.
        summary: In a few words, for people.
        document: Everything, for the transcript.
    """

    is_accepted: bool
    feedback: tuple[str, ...]
    summary: str
    document: dict[str, object]
    score: tuple[float, ...] = ()
    is_measured: bool = False
