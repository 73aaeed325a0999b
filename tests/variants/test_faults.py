"""Faults of models and endpoints, played over HTTP against the stand-in: the rows of faults.csv.

Calls are given by their role (m modifier, r reviewer, e engineer, v viewer); attempts and re-asks
are calls of their own.
"""

import csv
import re
from dataclasses import replace
from pathlib import Path

import pytest

from augment.errors import ModelFault
from augment.fake_llm.server import MODELS, FakeServer
from augment.variants.pipeline import EditTask
from augment.variants.recipes import find_recipe
from augment.variants.respondents import ModelRole
from tests.scenes import scene
from tests.variants.playing import MemoryTranscript, play, stand_in_model

WISH = "Add a parked vehicle 21.4 m ahead of the ego in its lane."
with (Path(__file__).parent / "faults.csv").open(encoding="utf-8", newline="") as _file:
    FAULTS = list(csv.DictReader(_file))
REVIEWS = {None: "none", True: "accepted", False: "not accepted"}


@pytest.mark.parametrize("row", FAULTS, ids=lambda row: f"{row['fault']} ({row['variant']})")
def test_a_fault_ends_as_expected(server: FakeServer, row: dict[str, str]) -> None:
    model = row["model"]
    timeout_s = 0.5 if model == "fake-slow" else 30.0
    task, transcript = EditTask(scene=scene(), instruction=WISH), MemoryTranscript()
    with stand_in_model(server, model, timeout_s=timeout_s) as modifier:
        players = {
            ModelRole(role): replace(modifier, model=name)
            for role, name in re.findall(r"(\w+) (fake-[\w-]+)", row["other_roles"])
        }
        try:
            made = play(find_recipe(row["variant"]), task, modifier, transcript, players)
            found = made.status.value
            reviewed = REVIEWS[made.is_accepted] if made.modification else ""
        except ModelFault as fault:
            found = "fails, may pass" if fault.retryable else "fails for good"
            reviewed = ""
    assert model == "fake-cuts-context" or all(
        (call.reply is None) != (call.fault is None) for call in transcript.calls
    )
    asked = "".join(call.role[0] for call in transcript.calls)
    assert (asked, found, reviewed) == (row["calls"], row["outcome"], row["review"])


def test_every_model_of_the_stand_in_has_its_row() -> None:
    named = {
        name
        for row in FAULTS
        for name in re.findall(r"fake-[\w-]+", f"{row['model']} {row['other_roles']}")
    }
    # Its mistakes are of all kinds and it comes to all outcomes.
    assert named == MODELS.keys() - {"fake-careless"}
