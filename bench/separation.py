"""How well measures tell careless answers from right ones: `python -m bench.separation [FOLDER]`.

Right are placements of the rule placer by several seeds: where a sentence leaves a choice they
differ, as answers of several people would. Careless are the stand-in's, without the function
(`otm`) and with it (`fc-plus`). FOLDER may hold a model's answers as SCENARIO.KIND.md, of which
`careless` ones are careless and all others right. Nothing is asked; a server is not needed.

Each answer is measured by its displacement from the reference, by the distance to the wish and by
the number of wrong findings. `told apart` is the share of pairs of a right and a careless answer
of one scenario in which the careless one is worse, ties half (0.5 is chance); its intervals are
percentiles of the bootstrap over scenarios. The spread is the standard deviation over all right
answers. Writes into docs/catalogue.md.
"""

import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from augment.baselines.rule_placer import place
from augment.checks import Ground, Severity
from augment.checks.registry import check_against_intent
from augment.errors import CannotPlace
from augment.fake_llm import careless
from augment.metrics.displacement import displacement, displacement_from_wish
from augment.prompts.reply import read_reply
from augment.scene.entities import Modification
from bench.moving_set import PROCESSES
from bench.report import ROOT, table, write_block
from tests.fixtures.shelf import HARD_SLUGS, MOVING_SLUGS, SLUGS, entry, shown_scene

SEEDS, SAMPLES, ROUNDS, SEED = 4, 5, 10_000, 2026
RIGHT, CARELESS = "right", "careless"
KINDS = {"otm": frozenset[str](), "fc-plus": careless.SPARED_BY_TOOL}
"""The stand-in's, with the mistakes that are spared."""
MEASURES = ("displacement", "wish", "findings")

Errors = NDArray[np.float64]
"""(N, 3): of N answers, by each of `MEASURES`; more is worse."""


def measure(slug: str, answers: Sequence[Modification | None]) -> Errors:
    """Return the errors of answers to one scenario; None is one that could not be read."""
    asked, ground = entry(slug), Ground.of(shown_scene(slug))
    assert asked.intent is not None
    rows = []
    for answer in answers:
        wish = displacement_from_wish(answer, asked.intent, ground)
        found = check_against_intent(ground, answer or Modification(), asked.intent)
        wrong = sum(one.severity is Severity.WRONG for one in found)
        far_m = displacement(answer, asked.reference, ground).error_m
        rows.append((far_m, np.nan if wish is None else wish.error_m, float(wrong)))
    return np.array(rows, dtype=np.float64).reshape(-1, len(MEASURES))


def measure_stand_ins(slug: str) -> dict[str, Errors]:
    """Return the errors of right answers, and of careless ones by kind; none of an unmet wish."""
    scene, intent = shown_scene(slug), entry(slug).intent
    try:
        right = [place(scene, intent, seed=seed).modification for seed in range(SEEDS)]
    except CannotPlace:
        return {}
    measured = {RIGHT: measure(slug, right)}
    for kind, spared in KINDS.items():
        bent: list[Modification | None] = []
        for sample in range(SAMPLES):
            rng = careless.dice(f"{slug} {sample}")
            is_lost, start = careless.is_unreadable(rng), right[sample % SEEDS]
            bent.append(None if is_lost else careless.bend(scene, start, rng, spared)[0])
        measured[kind] = measure(slug, bent)
    return measured


def measure_folder(folder: Path) -> list[dict[str, Errors]]:
    """Return the errors of a model's answers, right and careless ones, by scenario."""
    answers: defaultdict[str, dict[str, list[Modification | None]]]
    answers = defaultdict(lambda: {RIGHT: [], CARELESS: []})
    for file in sorted(folder.glob("*.*.md")):
        slug, kind, _ = file.name.split(".")
        reply = read_reply(file.read_text(encoding="utf-8"), scene=shown_scene(slug))
        answers[slug][CARELESS if kind == CARELESS else RIGHT].append(reply.modification)
    return [
        {kind: measure(slug, some) for kind, some in kinds.items()}
        for slug, kinds in answers.items()
    ]


def count_told_apart(measured: Sequence[Mapping[str, Errors]], kind: str) -> Errors:
    """Return the share of pairs (S, 3) that are told apart, by scenario and measure."""
    shares = []
    for errors in measured:
        gaps = errors[kind][:, None, :] - errors[RIGHT][None, :, :]
        # What differs by rounding alone is a tie.
        shares.append(((gaps > 1e-6) + 0.5 * (abs(gaps) <= 1e-6)).mean(axis=(0, 1)))
    return np.array(shares)


def make_row(
    title: Sequence[str], measured: Sequence[Mapping[str, Errors]], kind: str
) -> list[str]:
    """Return a row of the table: what right and careless answers have, and what tells them."""
    right = np.vstack([errors[RIGHT] for errors in measured])
    bent = np.vstack([errors[kind] for errors in measured])
    shares, rng = count_told_apart(measured, kind), np.random.default_rng(SEED)
    drawn = shares[rng.integers(len(shares), size=(ROUNDS, len(shares)))].mean(axis=1)
    lows, highs = np.percentile(drawn, [2.5, 97.5], axis=0)
    cells = [*title, str(len(measured))]
    for number in range(2):
        medians = [f"{np.median(some[:, number]):.2f}" for some in (right, bent)]
        cells += [*medians, f"{np.std(right[:, number], ddof=1):.2f}"]
    cells += [f"{(some[:, 2] > 0).mean():.0%}" for some in (right, bent)]
    means = shares.mean(axis=0)
    return cells + [
        f"{mean:.2f} [{low:.2f}, {high:.2f}]"
        for mean, low, high in zip(means, lows, highs, strict=True)
    ]


def report(folder: Path | None) -> str:
    """Return the table: a row for each kind of careless answers and set."""
    rows = []
    with get_context("spawn").Pool(PROCESSES) as pool:
        for title, slugs in (("still", [*SLUGS, *HARD_SLUGS]), ("moving", MOVING_SLUGS)):
            measured = [one for one in pool.map(measure_stand_ins, slugs, chunksize=1) if one]
            rows += [make_row((kind, title), measured, kind) for kind in KINDS]
    if folder is not None:
        rows.append(make_row(("a model's", "moving"), measure_folder(folder), CARELESS))
    head = ["careless", "set", "scenarios"]
    for name in ("displacement", "wish"):
        head += [f"{name} (m), right", "careless", "spread of right"]
    head += ["wrong by checks, right", "careless", "told apart by displacement"]
    return table([*head, "by wish", "by checks"], rows)


if __name__ == "__main__":
    text = report(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
    print(text)
    write_block("separation", text, page=ROOT / "docs" / "catalogue.md")
