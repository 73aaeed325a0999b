"""What a kind of review is, what it is shown of a round, and what it says about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from augment.checks import Ground
from augment.llm.messages import DEFAULT_MAX_TOKENS
from augment.prompts.vectors import DEFAULT_RADIUS_M
from augment.render.camera import WIDTH_PX
from augment.scene.entities import Modification, Scene
from augment.scene.intent import Intent
from augment.variants.pose_call import CallLimits
from augment.variants.respondents import Respondents
from augment.variants.transcript import ModelRole


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What one run of a recipe may use.

    Attributes:
        radius_m: How far around the ego the scene is written down.
        max_tokens: The length limit of one answer; a cut-off answer is asked again with twice it.
        re_asks: How often an answer that can't be read is asked for again.
        regenerations: How often a review can send the modifier back to work.
        calls: Of tools, in one round.
        accepted_from: The mean rating from which a text review is content.
        picture_px: The width of the picture that a viewer is shown.
    """

    radius_m: float = DEFAULT_RADIUS_M
    max_tokens: int = DEFAULT_MAX_TOKENS
    re_asks: int = 1
    regenerations: int = 2
    calls: CallLimits = field(default_factory=CallLimits)
    accepted_from: float = 4.0
    picture_px: int = WIDTH_PX


@dataclass(frozen=True, slots=True, kw_only=True)
class Submission:
    """What is reviewed, and whom a review may ask.

    Attributes:
        ground: The scene before the change, laid out for the checks.
        earlier: The modification of the round before, None in the first.
        told: What the modifier was told in the rounds before, in order.
        intent: What the instruction asks for: for the checks, never for a model.
    """

    ground: Ground
    instruction: str
    modification: Modification
    respondents: Respondents
    limits: Limits
    earlier: Modification | None = None
    told: tuple[str, ...] = ()
    intent: Intent | None = None

    @property
    def scene(self) -> Scene:
        """The scene before the change."""
        return self.ground.scene


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Review:
    """A kind of review.

    Attributes:
        name: As transcripts and the page on the method call it.
        judge: From a submission to its verdict; raises ReviewUnusable where there is none.
        asks: The roles of models in the order in which one review asks them.
        options: Names of the contestant's options that this review alone has a use for.
    """

    name: str
    judge: Callable[[Submission], Verdict]
    asks: tuple[ModelRole, ...] = ()
    options: tuple[str, ...] = ()
