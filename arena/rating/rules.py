"""How to rate: method, what is resampled, how often, by which seed."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from arena.rating.bootstrap import Unit


class Method(StrEnum):
    """How votes become ratings."""

    BRADLEY_TERRY = "bt"
    DAVIDSON = "davidson"
    ELO = "elo"


class Order(StrEnum):
    """What online Elo shows as its point; its rounds are always shuffled."""

    SHUFFLED = "shuffled"
    RECORDED = "recorded"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """How to rate."""

    method: Method
    unit: Unit
    rounds: int
    seed: int
    k: float
    order: Order
    details: bool

    def __post_init__(self) -> None:
        if self.rounds < 1:
            raise ValueError(f"a bootstrap needs at least 1 round, not {self.rounds}")
        if self.method is Method.ELO and self.unit is not Unit.VOTE:
            raise ValueError(f"online Elo resamples single votes only, not by {self.unit}")
