"""Ten thousand spoilt answers, to every role of every variant, without a crash.

    python -m bench.mutated_answers [COUNT [FIRST]]

A run of a variant is played with the stand-in's good answers, but from some answer on most of
them, the re-asked ones too, are spoilt: characters cut out, doubled or replaced, numbers and words
exchanged, the answer cut off or swapped for another role's. Whatever comes, the run ends in an
outcome whose numbers are finite; anything else is printed and counted.
"""

import json
import math
import random
import sys
import time
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache

from augment.fake_llm.playing import GOOD, LEARNING, Character
from augment.fake_llm.wire import chat_request
from augment.llm.client import Patience, Sending, watch_nothing
from augment.llm.messages import Reply, Request
from augment.variants.pipeline import Outcome, run
from augment.variants.recipes import RECIPES
from augment.variants.respondents import RespondentClient
from tests.fixtures.shelf import SLUGS, entry, shown_scene
from tests.intents import intents
from tests.variants.memory import MemoryTranscript

COUNT = 10_000
SEED = 20_261_121
PIECES = (
    *("", '"', "{", "}", "[", "]", ",", "\\", "9", "-", "e", "NaN", "1e999", "`", "\n", "null"),
    *("true", "Lane99", "Agent1", '"call"', "```", "</think>", "\x00", "\ud800", "\u202e", "5.5"),
)
VARIANTS = ("otm", "fc", "tqa", "geo", "fc+tqa")
"""The visual ones draw a picture in each round; they are played in every twentieth run."""
VISUAL = ("vqa", "fc+vqa")


class Answering:
    """Answers as a character does, but from one answer on it spoils most of them.

    Args:
        character: Who answers, as the stand-in would.
        spoilt: The number of the first spoilt answer, from 0.
        rng: How it is spoilt.
    """

    def __init__(self, character: Character, spoilt: int, rng: random.Random) -> None:
        self._character = character
        self._spoilt = spoilt
        self._rng = rng
        self._given: list[str] = []

    def fitted(self, request: Request) -> Request:
        return request

    def complete(self, request: Request, *, sending: Sending = watch_nothing) -> Reply:
        sending()
        text = _right_answer(self._character, request)
        first, later = len(self._given) == self._spoilt, len(self._given) > self._spoilt
        if first or (later and self._rng.random() < 0.6):
            text = spoilt(text, self._given, self._rng)
        self._given.append(text)
        return Reply(text=text, model="m", finish_reason="stop")


def spoilt(text: str, others: Sequence[str], rng: random.Random) -> str:
    """The text with something wrong."""
    if others and rng.random() < 0.05:
        return rng.choice(list(others))
    if rng.random() < 0.1:
        return text[: rng.randrange(len(text))]
    made = list(text)
    for _ in range(rng.randint(1, 8)):
        at = rng.randrange(len(made) + 1)
        if rng.random() < 0.2:
            made[at:at] = made[max(0, at - rng.randint(1, 200)) : at]
        else:
            made[at : at + rng.randint(0, 6)] = rng.choice(PIECES)
    return "".join(made)


def play(number: int, seed: int = SEED) -> Outcome:
    """One run with one spoilt answer; the same for the same number."""
    rng = random.Random(seed + number)
    variant = rng.choice(VISUAL if number % 20 == 0 else VARIANTS)
    slug = rng.choice(SLUGS)
    answering = Answering(rng.choice([GOOD, LEARNING]), rng.randrange(6), rng)
    outcome = run(
        RECIPES[variant],
        scene=shown_scene(slug),
        instruction=entry(slug).instruction,
        modifier=RespondentClient(client=answering, model="m"),
        transcript=MemoryTranscript(),
        patience=Patience(sleep=lambda _: None, rng=rng),
    )
    for agent in outcome.modification.changed if outcome.modification else ():
        assert math.isfinite(agent.x_m + agent.y_m + agent.heading_rad + agent.speed_mps)
    return outcome


def main(count: int, first: int = 0) -> int:
    outcomes: Counter[str] = Counter()
    crashes = 0
    began = time.perf_counter()
    for number in range(first, first + count):
        try:
            outcome = play(number)
        except Exception as error:  # the point is that there is none
            crashes += 1
            print(f"run {number}: {type(error).__name__}: {error}")
        else:
            outcomes[f"{outcome.status}, accepted: {outcome.is_accepted}"] += 1
        if (number + 1) % 1000 == 0:
            print(f"{number + 1 - first} runs, {crashes} crashes so far", flush=True)
    for name, times in outcomes.most_common():
        print(f"{times:>7}  {name}")
    print(f"{count} runs, {crashes} crashes, {time.perf_counter() - began:.0f} s")
    return crashes


def _right_answer(character: Character, request: Request) -> str:
    # As the wire would carry it; a lone half of a character is none that JSON can't carry.
    return _said(character, json.dumps(request.to_document()).encode())


@lru_cache(maxsize=2000)
def _said(character: Character, body: bytes) -> str:
    """The stand-in answers the same body the same way: of many runs it is asked once.

    What reads the answer is asked every time.
    """
    return character.answer(chat_request(body), intents)[0]


if __name__ == "__main__":
    numbers = [int(argument) for argument in sys.argv[1:3]]
    sys.exit(bool(main(*numbers) if numbers else main(COUNT)))
