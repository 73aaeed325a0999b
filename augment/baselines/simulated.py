"""Simulated contestants: the reference, a little off, and wrong on purpose at set rates.

They show how the system works and whether the checks see what is wrong. They know the reference,
so what they say about anybody's skill is nothing; they are marked wherever they turn up.
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields

from augment.baselines.simulated_faults import (
    HEADING_KINDS,
    LOGIC_KINDS,
    POSITION_KINDS,
    FaultKind,
    inject_fault,
)
from augment.baselines.simulated_format import FormatKind, spoiled_answer
from augment.baselines.simulated_road import jitter
from augment.errors import InvalidDocument, ReplyUnreadable
from augment.prompts.reply import read_reply
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Scene
from augment.scene.modification import Modification


@dataclass(frozen=True, slots=True, kw_only=True)
class Rates:
    """The share of answers with a fault of each class, together at most 1; a fault an answer."""

    position: float = 0.0
    heading: float = 0.0
    logic: float = 0.0
    format: float = 0.0

    def __post_init__(self) -> None:
        shares = asdict(self)
        problems = [
            (name, f"{share:g} is no share from 0 to 1")
            for name, share in shares.items()
            if not 0.0 <= share <= 1.0
        ]
        if not problems and sum(shares.values()) > 1.0 + 1e-9:
            problems = [("", f"the rates come to {sum(shares.values()):g}, more than 1")]
        if problems:
            raise InvalidDocument("set of error rates", problems)


PRESETS = {
    "low": Rates(position=0.06, heading=0.0, logic=0.04, format=0.0),
    "mid": Rates(position=0.12, heading=0.04, logic=0.14, format=0.02),
    "high": Rates(position=0.22, heading=0.06, logic=0.04, format=0.04),
}
"""The first three rates are those of the paper's table of errors in 50; the last is ours."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """What a simulated contestant answers.

    Attributes:
        modification: None where the answer can't be read.
        fault_class: "position", "heading", "logic" or "format"; empty where all is right.
        fault: Its kind: the true label.
        reason: Why the answer can't be read.
    """

    modification: Modification | None
    fault_class: str = ""
    fault: str = ""
    reason: str = ""


def simulate(scene: Scene, reference: Modification, rates: Rates, *, seed: int) -> Simulated:
    """One answer; the same for the same seed.

    A class of which no kind makes a difference on this scene (cones have no heading), or a scene
    without a lane under the ego, gives a right answer.

    Args:
        scene: The scene before the change.
        reference: What is right.
        rates: How often which class goes wrong.
        seed: Of this scenario and contestant.
    """
    rng = random.Random(seed)
    route = EgoRoute.of(scene)
    right = reference if route is None else jitter(route, reference, rng)
    wanted = _drawn(rates, rng)
    if wanted == "format":
        return _unwritten(scene, right, rng)
    if route is None or not wanted:
        return Simulated(modification=right)
    kinds = list(_KINDS[wanted])
    rng.shuffle(kinds)
    for kind in kinds:
        agents = inject_fault(route, right.added, kind, rng)
        if agents is not None:
            wrong = Modification(added=agents, moved=right.moved, removed=right.removed)
            return Simulated(modification=wrong, fault_class=wanted, fault=kind.value)
    return Simulated(modification=right)


def rates_of(document: Mapping[str, object]) -> Rates:
    """Rates by their names.

    Raises:
        InvalidDocument: A name is unknown, or a value is no share.
    """
    known = [field.name for field in fields(Rates)]
    problems = [
        (name, f"unknown; allowed: {', '.join(known)}" if name not in known else "no number")
        for name, value in document.items()
        if name not in known or not isinstance(value, (int, float))
    ]
    if problems:
        raise InvalidDocument("set of error rates", problems)
    return Rates(**{name: float(str(value)) for name, value in document.items()})


# Private

_KINDS: dict[str, tuple[FaultKind, ...]] = {
    "position": POSITION_KINDS,
    "heading": HEADING_KINDS,
    "logic": LOGIC_KINDS,
}


def _drawn(rates: Rates, rng: random.Random) -> str:
    """The class of this answer's fault, empty for none."""
    left = rng.random()
    for name, share in asdict(rates).items():
        if left < share:
            return name
        left -= share
    return ""


def _unwritten(scene: Scene, right: Modification, rng: random.Random) -> Simulated:
    kind = rng.choice(list(FormatKind))
    try:
        read = read_reply(spoiled_answer(scene, right, kind, rng), scene)
    except ReplyUnreadable as error:
        return Simulated(
            modification=None, fault_class="format", fault=kind.value, reason=str(error)
        )
    return Simulated(modification=read.modification, fault_class="format", fault=kind.value)
