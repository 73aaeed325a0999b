"""Read first: from a scene and an instruction to an outcome, along a recipe.

Scene -> prompt -> answer -> Modification. An answer that nobody can read and a refusal are
outcomes of the model and count as such; a broken wire is nobody's outcome and is raised.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from augment.errors import ModelRefused, ReplyUnreadable, UnknownName
from augment.llm.client import ChatClient
from augment.llm.patience import Patience
from augment.scene.entities import Scene
from augment.scene.modification import Modification
from augment.variants.asking import Conversation
from augment.variants.modifier import modify
from augment.variants.recipes import RECIPES, Recipe
from augment.variants.transcript import Transcript


class OutcomeStatus(StrEnum):
    """How a run ended."""

    DONE = "done"
    UNREADABLE = "unreadable"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a variant made of one scenario.

    Attributes:
        modification: None unless the status is done.
        notes: What the model said about its own work.
        reason: Why there is no modification, empty where there is one.
    """

    modification: Modification | None
    notes: str
    status: OutcomeStatus
    reason: str = ""


def run(
    recipe: Recipe,
    *,
    scene: Scene,
    instruction: str,
    client: ChatClient,
    model: str,
    transcript: Transcript,
    patience: Patience | None = None,
) -> Outcome:
    """Let a model modify a scene as the recipe says.

    Args:
        recipe: The variant.
        scene: The scene before the change.
        instruction: The user's wish in natural language.
        client: Who answers.
        model: The model id that it is asked for.
        transcript: Is handed every raw answer before it is read.
        patience: How faults that may pass are waited out; by default three attempts.

    Raises:
        UnknownName: Nobody can run a recipe with these parts.
        ModelFault: The wire or the endpoint broke; the same run may succeed later if it says so.
    """
    if recipe not in RECIPES.values():
        raise UnknownName("recipe", recipe.slug, sorted(RECIPES))
    conversation = Conversation(
        client=client, model=model, transcript=transcript, patience=patience or Patience()
    )
    try:
        read = modify(recipe, scene=scene, instruction=instruction, conversation=conversation)
    except ReplyUnreadable as unreadable:
        return _without(OutcomeStatus.UNREADABLE, "; ".join(unreadable.problems))
    except ModelRefused as refused:
        return _without(OutcomeStatus.REFUSED, str(refused))
    return Outcome(modification=read.modification, notes=read.notes, status=OutcomeStatus.DONE)


def _without(status: OutcomeStatus, reason: str) -> Outcome:
    return Outcome(modification=None, notes="", status=status, reason=reason)
