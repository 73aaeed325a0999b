"""How many sentences the grammar reads and the rule placer places, how far from the references.

Counts alone are printed, never a sentence: the paraphrases stay unread by whoever writes rules.

    python -m tests.benchmarks.grammar_coverage
"""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from statistics import mean, median

from augment.baselines.rule_placer import place
from augment.errors import InstructionNotUnderstood
from augment.instruction import parse
from augment.metrics.displacement import displacement
from tests.fixtures.shelf import FOLDER, SLUGS, entry, shown_scene


def coverage(texts: dict[str, str]) -> None:
    """Print how many texts are read and placed, by type, and the displacement by type."""
    read: Counter[str] = Counter()
    placed: Counter[str] = Counter()
    apart_m: dict[str, list[float]] = defaultdict(list)
    for slug, text in texts.items():
        kind = entry(slug).type.value
        try:
            parse(text)
            read[kind] += 1
            made = place(shown_scene(slug), text).modification
        except InstructionNotUnderstood:
            continue
        placed[kind] += 1
        reference = entry(slug).reference
        if reference is not None:
            apart_m[kind] += displacement(made, reference).distances_m
    print(f"read {read.total()}, placed {placed.total()} of {len(texts)}")
    for kind, errors_m in sorted(apart_m.items()):
        print(
            f"  {kind}: read {read[kind]}, placed {placed[kind]}, {len(errors_m)} objects, "
            f"median {median(errors_m):.2f} m, mean {mean(errors_m):.2f} m, "
            f"worst {max(errors_m):.2f} m"
        )


def main() -> None:
    """The instructions of the catalogue, then its held-out paraphrases."""
    print("instructions:")
    coverage({slug: entry(slug).instruction for slug in SLUGS})
    print("held-out paraphrases:")
    coverage(json.loads((FOLDER / "paraphrases.json").read_text())["paraphrases"])


if __name__ == "__main__":
    main()
