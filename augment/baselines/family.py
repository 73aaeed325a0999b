"""A family of an intent: the same wish with numbers drawn from its ranges, each placed."""

from dataclasses import dataclass

import numpy as np

from augment.baselines.rule_placer import place
from augment.errors import CannotPlace
from augment.scene.codec import intent_from_document, intent_to_document
from augment.scene.entities import Modification, Scene
from augment.scene.intent import Intent
from augment.scene.numbers import draw_ranges


@dataclass(frozen=True, slots=True, kw_only=True)
class FamilyMember:
    """One of a family.

    Attributes:
        intent: With exact numbers in the place of ranges.
        modification: What the rule placer makes of it; None where nothing fits.
        refusal: Why nothing fits.
    """

    intent: Intent
    modification: Modification | None = None
    refusal: str = ""


def sample_family(
    scene: Scene, intent: Intent, *, count: int, seed: int = 0
) -> tuple[FamilyMember, ...]:
    """Return so many members; the first ones are the same whatever the count.

    Raises:
        CannotPlace: No number of the intent is a range.
    """
    document = intent_to_document(intent)
    if draw_ranges(document, np.random.default_rng(seed)) == document:
        raise CannotPlace("No number of the intent is a range (low_m, high_m) to draw from.")
    members = []
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        exact = intent_from_document(draw_ranges(document, rng))
        try:
            made = place(scene, exact, seed=int(rng.integers(2**32))).modification
        except CannotPlace as refused:
            members.append(FamilyMember(intent=exact, refusal=str(refused)))
        else:
            members.append(FamilyMember(intent=exact, modification=made))
    return tuple(members)
