"""Read first: from a scene and an instruction to an outcome, along a recipe.

Scene -> prompt -> answer -> Modification, and back with a review's findings where the recipe has
a review (rounds.py). An answer that nobody can read and a refusal are outcomes of the model and
count as such; whoever changes nothing refuses. A broken wire is nobody's outcome and is raised.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from augment.errors import ModelRefused, ReplyUnreadable, UnknownName
from augment.llm.patience import Patience
from augment.scene.entities import Modification, Scene
from augment.scene.intent import Intent
from augment.variants.modifier import Modifier
from augment.variants.recipes import RECIPES, Recipe
from augment.variants.respondents import RespondentClient, Respondents, Sampling
from augment.variants.rounds import modify_and_review
from augment.variants.transcript import ModelRole, Transcript


class OutcomeStatus(StrEnum):
    """How a run ended."""

    DONE = "done"
    UNREADABLE = "unreadable"
    REFUSED = "refused"


LEFT_ALONE = "The modifier left the scene as it is and did not say why."


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a variant made of one scenario.

    Attributes:
        modification: None unless the status is done.
        notes: What the model said about its own work, and what a review made of it.
        reason: Why there is no modification, empty where there is one.
        is_accepted: What the review said of the modification, None without a usable review.
    """

    modification: Modification | None
    notes: str
    status: OutcomeStatus
    reason: str = ""
    is_accepted: bool | None = None


def run(
    recipe: Recipe,
    *,
    scene: Scene,
    instruction: str,
    modifier: RespondentClient,
    transcript: Transcript,
    patience: Patience | None = None,
    others: Mapping[ModelRole, RespondentClient] | None = None,
    intent: Intent | None = None,
    sampling: Sampling | None = None,
) -> Outcome:
    """Let a model modify a scene as the recipe says.

    Args:
        recipe: The variant, within whatever limits.
        scene: The scene before the change.
        instruction: The user's wish in natural language.
        modifier: Who modifies.
        transcript: Is handed every raw answer before it is read.
        patience: How faults that may pass are waited out; by default three attempts.
        others: Who plays the reviewers' roles; by default the modifier's model does.
        intent: What a geometric review holds modifications against, where that is stored.
        sampling: What every request is sent with.

    Raises:
        UnknownName: Nobody can run a recipe with these parts.
        ModelFault: The wire or the endpoint broke; the same run may succeed later if it says so.
    """
    known = RECIPES.get(recipe.slug)
    if known is None or replace(recipe, limits=known.limits) != known:
        raise UnknownName("recipe", recipe.slug, sorted(RECIPES))
    respondents = Respondents(
        clients={**(others or {}), ModelRole.MODIFIER: modifier},
        transcript=transcript,
        patience=patience or Patience(),
        sampling=sampling or Sampling(),
    )
    modification = Modifier(recipe=recipe, scene=scene, respondents=respondents, intent=intent)
    try:
        result = modify_and_review(modification, instruction)
    except ReplyUnreadable as unreadable:
        return _without(OutcomeStatus.UNREADABLE, "; ".join(unreadable.problems))
    except ModelRefused as refused:
        return _without(OutcomeStatus.REFUSED, str(refused))
    read = result.kept.read
    if read.modification.is_empty:
        return _without(OutcomeStatus.REFUSED, read.notes or LEFT_ALONE)
    return Outcome(
        modification=read.modification,
        notes="\n\n".join(part for part in (read.notes, result.remark) if part),
        status=OutcomeStatus.DONE,
        is_accepted=result.is_accepted,
    )


def _without(status: OutcomeStatus, reason: str) -> Outcome:
    return Outcome(modification=None, notes="", status=status, reason=reason)
