"""The three kinds of review: what each is shown of a round, whom it asks, what it says.

Text: a model rates in three categories; it gets scene, wish and changed vectors, never the
modifier's reasoning. Visual: an engineer asks, a viewer looks at the picture, the engineer
decides. Geometric, our own: the deterministic checks speak, no model does; where the scenario has
an intent they are held against it as well.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

from augment.checks import Ground, Severity
from augment.checks.registry import check_against_intent
from augment.errors import ModelRefused, ReplyUnreadable, ReviewUnusable
from augment.llm.messages import DEFAULT_MAX_TOKENS
from augment.prompts import fill
from augment.prompts.reply import read_questions, read_ratings, read_sight, read_verdict
from augment.prompts.vectors import DEFAULT_RADIUS_M, short_names, with_short_ids
from augment.render.bev import draw_for_review
from augment.render.camera import WIDTH_PX, camera_for
from augment.scene.entities import Modification, Scene
from augment.scene.intent import Intent
from augment.variants.respondents import ModelRole, Respondents


class BlockForm(StrEnum):
    """Way to the block of a modifier: within its answer, or by a schema in a call of its own."""

    TEXT = "text"
    SCHEMA = "schema"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of one run of a recipe, and how its modifier writes its block.

    Attributes:
        radius_m: How far around the ego the scene is written down.
        max_output_tokens: The length limit of one answer; a cut-off one is asked again with
            twice it.
        re_asks: How often an answer that can't be read is asked for again.
        rounds: How often a reviewed modifier is put to work at most.
        calls: Of tools, in one round.
        identical_calls: Of these with the very same arguments.
        accepted_from: The mean rating from which a text review is content.
        picture_px: The width of the picture that a viewer is shown.
        block: How the modifier writes its block.
    """

    radius_m: float = DEFAULT_RADIUS_M
    max_output_tokens: int = DEFAULT_MAX_TOKENS
    re_asks: int = 1
    rounds: int = 3
    calls: int = 8
    identical_calls: int = 3
    accepted_from: float = 4.0
    picture_px: int = WIDTH_PX
    block: BlockForm = BlockForm.TEXT


@dataclass(frozen=True, slots=True, kw_only=True)
class ReviewedAnswer:
    """Answer under review, and the clients that a review may ask.

    Attributes:
        ground: The scene before the change, laid out for the checks.
        earlier: The modification of the round before, None in the first.
        told: What the modifier was told in the rounds before, in order.
        intent: What the instruction asks for: for the checks, never for a model.
        refusal: Why nothing is changed, where the modifier said so.
    """

    ground: Ground
    instruction: str
    modification: Modification
    respondents: Respondents
    limits: Limits
    earlier: Modification | None = None
    told: tuple[str, ...] = ()
    intent: Intent | None = None
    refusal: str = ""

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
        judge: From a reviewed answer to its verdict; raises ReviewUnusable where there is none.
        asks: The roles of models in the order in which one review asks them.
        options: Names of the contestant's options that this review alone has a use for.
    """

    name: str
    judge: Callable[[ReviewedAnswer], Verdict]
    asks: tuple[ModelRole, ...] = ()
    options: tuple[str, ...] = ()


def review_text(answer: ReviewedAnswer) -> Verdict:
    """Return the text reviewer's verdict; the mean of its ratings is computed here.

    Raises:
        ReviewUnusable: He declined, or neither his first nor his re-asked ratings can be read.
        ModelFault: The wire broke for good.
    """
    accepted_from = answer.limits.accepted_from
    messages = _review_messages(ModelRole.REVIEWER, answer)
    reader = partial(read_ratings, accepted_from=accepted_from)
    with _unusable("the reviewer"):
        review, _, _ = answer.respondents.read(ModelRole.REVIEWER, messages, reader)
    ratings, document = review.ratings, review.model_dump()
    accepted = ratings.mean >= accepted_from
    return Verdict(
        is_accepted=accepted,
        score=(ratings.mean,),
        feedback=() if accepted else tuple(entry.sentence for entry in review.feedback),
        summary=(
            f"mean rating {ratings.mean:.2f} (compliance {ratings.compliance}, realism "
            f"{ratings.realism}, logical consistency {ratings.logical_consistency})"
        ),
        document={"ratings": document.pop("ratings"), "mean": round(ratings.mean, 4), **document},
    )


def review_picture(answer: ReviewedAnswer) -> Verdict:
    """Return the engineer's verdict on what the viewer sees.

    Raises:
        ReviewUnusable: One of the two declined or can't be read, not even asked once more.
        ModelFault: The wire broke for good.
    """
    read = answer.respondents.read
    messages = _review_messages(ModelRole.ENGINEER, answer)
    with _unusable("a reviewer"):
        questions, talk_before, reply = read(ModelRole.ENGINEER, messages, read_questions)
        shown = pictures(answer.scene, answer.modification, width_px=answer.limits.picture_px)
        seen, _, _ = read(
            ModelRole.VIEWER,
            fill.viewer_messages(questions, shown),
            partial(read_sight, count=len(questions)),
            again=partial(fill.review_re_ask_messages, text="viewer_re_ask.md"),
        )
        talk = (*talk_before, fill.model_message(reply.text))
        messages = fill.verdict_messages(talk, questions, seen)
        verdict, _, _ = read(ModelRole.ENGINEER, messages, read_verdict)
    accepted = not verdict.feedback
    return Verdict(
        is_accepted=accepted,
        score=(float(accepted),),
        feedback=tuple(entry.sentence for entry in verdict.feedback),
        summary="accepted" if accepted else f"{len(verdict.feedback)} problems named",
        document={
            "questions": list(questions),
            "answers": {str(number): seen[number] for number in sorted(seen)},
            "accepted": accepted,
            **verdict.model_dump(exclude={"verdict"}),
        },
    )


def review_geometry(answer: ReviewedAnswer) -> Verdict:
    """Return the verdict of the checks on a modification.

    Without an intent a doubtful finding may be just what was asked for: a modifier that keeps
    its modification in spite of doubts has the last word, in spite of what is wrong it has not.
    """
    findings = check_against_intent(answer.ground, answer.modification, answer.intent)
    wrong = [finding for finding in findings if finding.severity is Severity.WRONG]
    doubtful = [finding for finding in findings if finding.severity is Severity.DOUBTFUL]
    insists = answer.modification == answer.earlier
    accepted = not wrong and (not doubtful or insists)
    names = short_names(answer.scene)
    shown_names = names.agents | names.lanes
    return Verdict(
        is_accepted=accepted,
        score=(-float(len(wrong)), -float(len(doubtful))),
        feedback=tuple(
            f"{finding.severity.value.capitalize()}: {finding.sentence(shown_names)}"
            for finding in (*wrong, *doubtful)
        ),
        is_measured=True,
        summary=f"{len(wrong)} findings wrong, {len(doubtful)} doubtful",
        document={
            "wrong": len(wrong),
            "doubtful": len(doubtful),
            "accepted": accepted,
            "findings": [
                {
                    "kind": finding.kind.value,
                    "severity": finding.severity.value,
                    "agents": list(finding.agents),
                    "sentence": finding.sentence(shown_names),
                }
                for finding in findings
            ],
        },
    )


def pictures(
    scene: Scene, modification: Modification, *, width_px: int = WIDTH_PX
) -> tuple[bytes, ...]:
    """Draw what the viewer is shown: a PNG with ids and metres, and the change enlarged.

    The ids are those of the engineer's vectors; the window depends on the scene and on what is
    reviewed, never on a reference.
    """
    names = short_names(scene)
    shown, change = with_short_ids(scene, names), with_short_ids(modification, names)
    return draw_for_review(shown, change, camera_for(shown, change).at_width(width_px))


TEXT_REVIEW = Review(
    name="text", judge=review_text, asks=(ModelRole.REVIEWER,), options=("accepted_from",)
)
VISUAL_REVIEW = Review(
    name="visual",
    judge=review_picture,
    asks=(ModelRole.ENGINEER, ModelRole.VIEWER, ModelRole.ENGINEER),
    options=("picture_px",),
)
GEOMETRIC_REVIEW = Review(name="geometric", judge=review_geometry)


# Private


def _review_messages(role: ModelRole, answer: ReviewedAnswer) -> fill.Messages:
    return fill.review_messages(
        role,
        answer.scene,
        answer.instruction,
        answer.modification,
        radius_m=answer.limits.radius_m,
        earlier=answer.told,
        refusal=answer.refusal,
    )


@contextmanager
def _unusable(who: str) -> Iterator[None]:
    """Turn a reviewer's unreadable answer or refusal into an unusable review."""
    try:
        yield
    except ReplyUnreadable as unreadable:
        raise ReviewUnusable(f"{who}: {'; '.join(unreadable.problems)}") from unreadable
    except ModelRefused as refused:
        raise ReviewUnusable(f"{who} declined: {refused}") from refused
