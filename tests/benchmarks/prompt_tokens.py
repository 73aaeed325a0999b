"""How large the prompts are, per variant, before and now, and what the stand-in makes of them.

    REALDATA_DIR=... python -m tests.benchmarks.prompt_tokens

Tokens are those of the vocabulary `o200k_base`, counted in an environment of its own, of the
first prompts of all roles of a variant; authored is the mean over the 12 scenes of the paper set.
Ends with 1 where a prompt on a recorded scene is not `LESS` smaller than before. Displacement:
what the rule placer makes of the scene and the intent as read back out of the modifier's prompt,
against the reference, over all objects of the catalogue and of the hard set.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import fmean, mean, median

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
from augment.variants.showing import roles_of, shown_prompt
from tests.benchmarks.rivals.environments import RIVALS, python_of
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry, shown_scene, whole_scene
from tests.intents import intents
from tests.variants.pose_accuracy import recorded_scenes

VOCABULARY = "o200k_base"
WISH = "Add a parked car 21.4 m ahead of the ego, 0.5 m left of the lane centre."
AUTHORED = "authored"
LESS = 0.3

_SCENES = (AUTHORED, "av2", "commonroad", "scenarionet", "waymo")
BEFORE = {
    "otm": dict(zip(_SCENES, (4729, 12091, 8944, 9963, 11055), strict=True)),
    "fc": dict(zip(_SCENES, (4606, 12789, 8566, 10786, 11373), strict=True)),
    "tqa": dict(zip(_SCENES, (8811, 23535, 17241, 19279, 21463), strict=True)),
    "vqa": dict(zip(_SCENES, (8568, 23292, 16998, 19036, 21220), strict=True)),
}
"""At commit ec06738, when all lanes within 80 m were listed and curves kept to 0.3 m."""


def main() -> int:
    authored = sorted({entry(slug).scene for slug in SLUGS})
    scenes = {AUTHORED: [whole_scene(name) for name in authored]}
    recorded = recorded_scenes(Path(os.environ["REALDATA_DIR"]))
    scenes |= {one.name: [one] for one in recorded}
    print(f"| variant | {' | '.join(scenes)} |\n|{'---|' * (len(scenes) + 1)}")
    enough = True
    for slug, before in BEFORE.items():
        now = {name: mean(tokens(slug, ones)) for name, ones in scenes.items()}
        less = {name: 1.0 - now[name] / before[name] for name in scenes}
        cells = (f"{before[n]:,} to {now[n]:,.0f} ({-100 * less[n]:+.0f} %)" for n in scenes)
        print(f"| `{slug}` | {' | '.join(cells)} |")
        enough &= all(less[one.name] >= LESS for one in recorded)
    for form in LaneFormat:
        for title, slugs in (("paper set", SLUGS), ("hard set", HARD_SLUGS)):
            off_m = displacements(form, slugs)
            print(
                f"displacement, {form}, {title}: {len(off_m)} objects, "
                f"median {median(off_m):.3f} m, mean {fmean(off_m):.3f} m"
            )
    return int(not enough)


def tokens(slug: str, scenes: list[Scene]) -> list[int]:
    """Of the first prompts of all roles together, by scene."""
    recipe = RECIPES[slug]
    texts = [
        [
            message.text
            for role in roles_of(recipe)
            for message in shown_prompt(recipe, role, scene, WISH, Modification()).messages
        ]
        for scene in scenes
    ]
    counts = iter(counted([text for one in texts for text in one]))
    return [sum(next(counts) for _ in one) for one in texts]


def counted(texts: list[str]) -> list[int]:
    """How many tokens each text has."""
    ended = subprocess.run(
        [str(python_of("tokens")), str(RIVALS / "tokens" / "counter.py"), VOCABULARY],
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
    sys.exit(main())
