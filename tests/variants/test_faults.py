"""docs/faults.md, row by row: what it says of a fault is what happens."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from augment.errors import ModelFault
from augment.fake_llm.models import MODELS
from augment.fake_llm.server import FakeServer, running
from augment.llm.openai_wire import OpenAIWire
from augment.llm.patience import Patience
from augment.variants.pipeline import run
from augment.variants.recipes import RECIPES, find_recipe
from augment.variants.respondents import RespondentClient
from augment.variants.transcript import MemoryTranscript, ModelRole
from tests.intents import intents
from tests.scenes import scene

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
WISH = "Add a parked vehicle 21.4 m ahead of the ego in its lane."
REVIEWS = {None: "none", True: "accepted", False: "not accepted"}


def table(number: int) -> list[list[str]]:
    """The rows of a table of the page, without its head."""
    blocks = re.findall(r"(?:^\|.*\|\n)+", TEXT, re.MULTILINE)
    lines = blocks[number].splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


FAULTS, ELSEWHERE = table(0), table(1)


@pytest.fixture(scope="module")
def server() -> Iterator[FakeServer]:
    with running(slow_s=30.0, intents=intents) as serving:
        yield serving


@pytest.mark.parametrize("row", FAULTS, ids=lambda row: f"{row[0]} ({row[1].strip('`')})")
def test_a_fault_ends_as_the_page_says(server: FakeServer, row: list[str]) -> None:
    _, variant, model, others, calls, outcome, review = (cell.replace("`", "") for cell in row)
    timeout_s = 0.5 if model == "fake-slow" else 30.0
    transcript = MemoryTranscript()
    with OpenAIWire(base_url=server.url, api_key=None, timeout_s=timeout_s) as client:
        players = {
            ModelRole(role): RespondentClient(client=client, model=name)
            for role, name in re.findall(r"(\w+) (fake-[\w-]+)", others)
        }
        try:
            made = run(
                find_recipe(variant),
                scene=scene(),
                instruction=WISH,
                modifier=RespondentClient(client=client, model=model),
                transcript=transcript,
                patience=Patience(sleep=lambda _: None, rng=random.Random(0)),
                others=players,
            )
            found = made.status.value
            reviewed = REVIEWS[made.is_accepted] if made.modification else ""
        except ModelFault as fault:
            found = "fails, may pass" if fault.retryable else "fails for good"
            reviewed = ""
    asked = "".join(call.role[0] for call in transcript.calls)
    assert (asked, found, reviewed) == (calls, outcome, review)


def test_every_model_of_the_stand_in_has_its_row() -> None:
    named = set(re.findall(r"`(fake-[\w-]+)`", TEXT))
    # Its mistakes are of all kinds and it comes to all outcomes.
    assert named == MODELS.keys() - {"fake-careless"}


@pytest.mark.parametrize("row", ELSEWHERE, ids=lambda row: row[0])
def test_what_the_page_leans_on_is_there(row: list[str]) -> None:
    path, _, name = row[2].strip("`").partition("::")
    assert f"def {name}(" in (ROOT / path).read_text(encoding="utf-8")


def test_the_page_of_variants_names_every_recipe_and_its_parts() -> None:
    page = (ROOT / "docs" / "variants.md").read_text(encoding="utf-8")
    rows = {
        cells[0].strip("` "): cells
        for cells in (line.strip("|").split("|") for line in page.splitlines())
        if len(cells) == 6
    }
    for slug, one in RECIPES.items():
        _, lanes, tool, review, counts, origin = rows[slug]
        assert ("Bezier" in lanes) is (one.lane_format == "bezier")
        assert ("pose_on_lane" in tool) is (one.tools == "pose")
        assert review.strip() == one.review
        assert ("of equals the last" in counts) is (one.keep == "best")
        assert ("ours" in origin) is (one.review == "geometric")
