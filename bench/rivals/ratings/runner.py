"""Runs one rival on one file of votes, in the rival's own environment; prints one line of JSON.

    python runner.py NAME VOTES.npz ROUNDS CALLS

Knows nothing of ours, as its environment has nothing of ours. A rival gets its data in the form it
takes (a data frame or counts), made before the clock starts. The first call and later ones are
timed apart; memory is the largest that the process ever held.
"""

from __future__ import annotations

import importlib
import json
import resource
import sys
import time
import types
from collections.abc import Callable
from typing import Any

import numpy as np

WINNERS = ("model_a", "tie", "model_b")
Votes = dict[str, Any]
Ratings = dict[str, list[float]]


def frame(votes: Votes) -> Any:
    pandas = importlib.import_module("pandas")
    names = np.array([f"c{index:03d}" for index in range(int(votes["contestants"]))])
    return pandas.DataFrame(
        {
            "model_a": names[votes["first"]],
            "model_b": names[votes["second"]],
            "winner": np.array(WINNERS)[votes["outcome"]],
        }
    )


def fastchat() -> Any:
    """The rating functions of the published package, without what they need to draw and to chat.

    Its module imports the whole of torch for the names of models; that is left out here.
    """
    for name in (
        "plotly",
        "plotly.express",
        "fastchat.model",
        "fastchat.model.model_registry",
        "fastchat.serve.monitor.basic_stats",
        "fastchat.serve.monitor.clean_battle_data",
    ):
        sys.modules[name] = types.ModuleType(name)
    for name, wanted in (
        ("fastchat.model.model_registry", "get_model_info"),
        ("fastchat.serve.monitor.basic_stats", "get_log_files"),
        ("fastchat.serve.monitor.clean_battle_data", "clean_battle_data"),
    ):
        setattr(sys.modules[name], wanted, None)
    setattr(sys.modules["plotly"], "express", sys.modules["plotly.express"])  # noqa: B010
    return importlib.import_module("fastchat.serve.monitor.elo_analysis")


def fastchat_bt(votes: Votes, rounds: int) -> Callable[[], Ratings]:
    module, battles = fastchat(), frame(votes)
    return _fastchat(module, battles, module.compute_elo_mle_with_tie, rounds)


def fastchat_elo(votes: Votes, rounds: int) -> Callable[[], Ratings]:
    module, battles = fastchat(), frame(votes)
    return _fastchat(module, battles, module.compute_elo, rounds)


def _fastchat(module: Any, battles: Any, rate: Any, rounds: int) -> Callable[[], Ratings]:
    def call() -> Ratings:
        rows = module.get_bootstrap_result(battles, rate, rounds)
        rows = rows[sorted(rows.columns)]
        return {
            "rating": rows.median().tolist(),
            "lower": rows.quantile(0.025).tolist(),
            "upper": rows.quantile(0.975).tolist(),
        }

    return call


def arena_rank(votes: Votes, rounds: int) -> Callable[[], Ratings]:
    """Its default, intervals in closed form; from the data frame, as it counts by itself."""
    data = importlib.import_module("arena_rank.utils.data_utils")
    models = importlib.import_module("arena_rank.models.bradley_terry")
    battles = frame(votes)

    def call() -> Ratings:
        counted = data.PairDataset.from_pandas(battles)
        model = models.BradleyTerry(n_competitors=len(counted.competitors))
        found = model.compute_ratings_and_cis(counted)
        kinds = {"rating": "ratings", "lower": "rating_lower", "upper": "rating_upper"}
        return {ours: np.asarray(found[theirs]).tolist() for ours, theirs in kinds.items()}

    return call


def choix(votes: Votes, rounds: int) -> Callable[[], Ratings]:
    """It rates and has no intervals: counting and the loop over rounds are added here.

    Every round starts at the ratings of the data, as ours do.
    """
    package = importlib.import_module("choix")
    contestants = int(votes["contestants"])

    def call() -> Ratings:
        kind = (votes["first"] * contestants + votes["second"]) * 3 + votes["outcome"]
        kinds, seen = np.unique(kind, return_counts=True)
        first, second, outcome = kinds // 3 // contestants, kinds // 3 % contestants, kinds % 3

        def wins_of(counts: Any) -> Any:
            wins = np.zeros((contestants, contestants))
            np.add.at(wins, (first, second), counts * (1.0 - 0.5 * outcome))
            np.add.at(wins, (second, first), counts * 0.5 * outcome)
            return wins

        rng = np.random.default_rng(0)
        start = package.ilsr_pairwise_dense(wins_of(seen))
        drawn = [
            package.ilsr_pairwise_dense(wins_of(counts), initial_params=start)
            for counts in rng.multinomial(int(seen.sum()), seen / seen.sum(), size=rounds)
        ]
        rated = np.array(drawn) * 400.0 / np.log(10.0) + 1000.0
        low, middle, high = np.percentile(rated, [2.5, 50.0, 97.5], axis=0)
        return {"rating": middle.tolist(), "lower": low.tolist(), "upper": high.tolist()}

    return call


def evalica_bt(votes: Votes, rounds: int) -> Callable[[], Ratings]:
    """Its own bootstrap goes vote by vote; rated by counts it is many times faster.

    Counting and the loop over rounds are added here, as for choix.
    """
    package = importlib.import_module("evalica")
    contestants = int(votes["contestants"])
    winners = [package.Winner.X, package.Winner.Draw, package.Winner.Y]

    def call() -> Ratings:
        kind = (votes["first"] * contestants + votes["second"]) * 3 + votes["outcome"]
        kinds, seen = np.unique(kind, return_counts=True)
        first, second = (kinds // 3 // contestants).tolist(), (kinds // 3 % contestants).tolist()
        outcomes = [winners[index] for index in (kinds % 3).tolist()]
        rng = np.random.default_rng(0)
        drawn = []
        for counts in rng.multinomial(int(seen.sum()), seen / seen.sum(), size=rounds):
            weights = counts.astype(np.float64).tolist()
            drawn.append(package.bradley_terry(first, second, outcomes, weights=weights).scores)
        np.percentile(np.array(drawn), [2.5, 50.0, 97.5], axis=0)
        return {}  # not on the Elo scale

    return call


def evalica_elo(votes: Votes, rounds: int) -> Callable[[], Ratings]:
    return _evalica(votes, rounds, "elo")


def _evalica(votes: Votes, rounds: int, method: str) -> Callable[[], Ratings]:
    package = importlib.import_module("evalica")
    winners = [package.Winner.X, package.Winner.Draw, package.Winner.Y]
    battles = frame(votes)
    first, second = battles["model_a"].tolist(), battles["model_b"].tolist()
    outcomes = [winners[index] for index in votes["outcome"].tolist()]

    def call() -> Ratings:
        package.bootstrap(
            getattr(package, method),
            first,
            second,
            outcomes,
            n_resamples=rounds,
            bootstrap_method="percentile",
            random_state=0,
        )
        return {}  # not on the Elo scale

    return call


RIVALS = {
    "fastchat-bt": fastchat_bt,
    "fastchat-elo": fastchat_elo,
    "arena-rank": arena_rank,
    "choix": choix,
    "evalica-bt": evalica_bt,
    "evalica-elo": evalica_elo,
}


def main() -> None:
    name, path, rounds, calls = sys.argv[1:]
    votes = dict(np.load(path))
    call = RIVALS[name](votes, int(rounds))
    took, ratings = [], {}
    for _ in range(int(calls)):
        began = time.perf_counter()
        ratings = call()
        took.append(time.perf_counter() - began)
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(json.dumps({"seconds": took, "memory_mb": own / 1024.0, "ratings": ratings}))


if __name__ == "__main__":
    main()
