"""How large the prompts are, per variant, and what the rule placer reads back out of them.

    REALDATA_DIR=... python -m bench.prompt_tokens [--write]

Tokens are those of the vocabulary `o200k_base`, counted in an environment of its own, of the
first prompts of all roles of a variant; authored is the mean over the scenes of the paper set.
Displacement: what the rule placer makes of the scene and the intent as read back out of the
modifier's prompt, against the reference, over all objects. `--write` stores both in
docs/benchmarks.md.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import fmean, mean, median

from augment.baselines.rule_placer import place
from augment.errors import CannotPlace
from augment.fake_llm.sight import task_of
from augment.fake_llm.wire import SpokenMessage
from augment.metrics.displacement import displacement
from augment.prompts.fill import Form, modifier_messages
from augment.prompts.vectors import LaneFormat
from augment.scene.entities import Modification, Scene
from augment.variants.recipes import RECIPES
from augment.variants.showing import shown_prompt
from bench.environments import BENCH, python_of
from bench.report import PAGE, table, write_block
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry, shown_scene, whole_scene
from tests.intents import intents
from tests.variants.test_pose_accuracy import recorded_scenes

VOCABULARY = "o200k_base"
WISH = "Add a parked car 21.4 m ahead of the ego, 0.5 m left of the lane centre."
AUTHORED = "authored"
VARIANTS = {"otm": "`otm`, `geo`", "fc": "`fc`, `fc+geo`", "tqa": "`tqa`", "vqa": "`vqa`"}


def main() -> None:
    """Count and print, or store."""
    print(text := f"{token_table()}\n\n{displacement_table()}")
    if "--write" in sys.argv[1:]:
        write_block("prompt tokens", text, page=PAGE)


def token_table() -> str:
    """Tokens of each variant's first prompts, by scene."""
    authored = sorted({entry(slug).scene for slug in SLUGS})
    scenes = {AUTHORED: [whole_scene(name) for name in authored]}
    scenes |= {one.name: [one] for one in recorded_scenes(Path(os.environ["REALDATA_DIR"]))}
    rows = [
        [title, *(f"{mean(tokens(slug, listed)):,.0f}" for listed in scenes.values())]
        for slug, title in VARIANTS.items()
    ]
    return table(["variant", *scenes], rows)


def displacement_table() -> str:
    """Displacement of what is placed from the scene as the prompt tells it."""
    rows = []
    for form in LaneFormat:
        for title, slugs in (("paper", SLUGS), ("hard", HARD_SLUGS)):
            off_m = displacements(form, slugs)
            figures = (str(len(off_m)), f"{median(off_m):.3f}", f"{fmean(off_m):.3f}")
            rows.append([str(form), title, *figures])
    return table(["lanes", "set", "objects", "median (m)", "mean (m)"], rows)


def tokens(slug: str, scenes: list[Scene]) -> list[int]:
    """Of the first prompts of all roles together, by scene."""
    recipe = RECIPES[slug]
    texts = [
        [
            message.text
            for role in recipe.roles
            for message in shown_prompt(recipe, role, scene, WISH, Modification()).messages
        ]
        for scene in scenes
    ]
    counts = iter(counted([text for one in texts for text in one]))
    return [sum(next(counts) for _ in one) for one in texts]


def counted(texts: list[str]) -> list[int]:
    """How many tokens each text has."""
    ended = subprocess.run(
        [str(python_of("tokens")), str(BENCH / "tokens" / "counter.py"), VOCABULARY],
        input=json.dumps(texts),
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    found: list[int] = json.loads(ended.stdout)
    return found


def displacements(form: LaneFormat, slugs: list[str]) -> list[float]:
    found: list[float] = []
    for slug in slugs:
        reference = entry(slug).reference
        assert reference is not None
        messages = modifier_messages(shown_scene(slug), entry(slug).instruction, Form(lanes=form))
        spoken = [SpokenMessage.model_validate(one.to_document()) for one in messages]
        task = task_of(spoken, intents)
        try:
            made = place(task.scene, task.intent).modification
        except CannotPlace:
            continue
        found += displacement(made, reference).distances_m
    return found


if __name__ == "__main__":
    main()
