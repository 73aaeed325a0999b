"""How large the prompts are, per variant, and what the stand-in makes of them.

    REALDATA_DIR=... python -m tests.benchmarks.prompt_tokens

Tokens are characters over `CHARACTERS_PER_TOKEN`, of the first prompts of all roles of a variant;
authored is the mean over the scenes of the fixtures. Displacement: what the rule placer makes of
the scene and the intent as read back out of the modifier's prompt, against the reference, over all
objects of the catalogue. Run it on two commits to compare them.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from statistics import mean, median

from augment.baselines.rule_placer import place
from augment.errors import CannotPlace
from augment.fake_llm.requests import SpokenMessage
from augment.fake_llm.sight import task_of
from augment.metrics.displacement import displacement
from augment.prompts.fill import Form, modifier_messages
from augment.prompts.vectors import LaneFormat
from augment.scene.entities import Scene
from augment.scene.modification import Modification
from augment.variants.recipes import RECIPES
from augment.variants.showing import CHARACTERS_PER_TOKEN, roles_of, shown_prompt
from tests.fixtures.shelf import SLUGS, entry, shown_scene
from tests.intents import intents
from tests.variants.pose_accuracy import authored_scenes, recorded_scenes

WISH = "Add a parked car 21.4 m ahead of the ego, 0.5 m left of the lane centre."


def main() -> None:
    authored = authored_scenes()
    recorded = recorded_scenes(Path(os.environ["REALDATA_DIR"]))
    print("tokens, all roles  authored" + "".join(f"{one.name:>13}" for one in recorded))
    for slug in RECIPES:
        sizes = [f"{tokens(slug, one):13.0f}" for one in recorded]
        print(f"{slug:18} {mean(tokens(slug, one) for one in authored):8.0f}" + "".join(sizes))
    for form in LaneFormat:
        off_m = displacements(form)
        print(
            f"displacement, {form}: {len(off_m)} objects, "
            f"median {median(off_m):.3f} m, mean {mean(off_m):.3f} m"
        )


def tokens(slug: str, scene: Scene) -> float:
    """Of the first prompts of all roles together."""
    recipe = RECIPES[slug]
    texts = [
        message.text
        for role in roles_of(recipe)
        for message in shown_prompt(recipe, role, scene, WISH, Modification()).messages
    ]
    return math.ceil(sum(map(len, texts)) / CHARACTERS_PER_TOKEN)


def displacements(form: LaneFormat) -> list[float]:
    found: list[float] = []
    for slug in SLUGS:
        reference = entry(slug).reference
        assert reference is not None
        messages = modifier_messages(shown_scene(slug), entry(slug).instruction, Form(lanes=form))
        spoken = [SpokenMessage.model_validate(one.to_document()) for one in messages]
        task = task_of(spoken, intents)
        try:
            made = place(task.scene, task.intent).modification
        except CannotPlace as refused:
            print(f"{slug}: {refused}")
            continue
        found += displacement(made, reference).distances_m
    return found


if __name__ == "__main__":
    main()
