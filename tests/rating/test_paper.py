"""What the paper prints comes out again."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from arena.management.rate_csv import run
from arena.rating.leaderboard import PAPER_ROUNDS, rate
from arena.rating.ranking import ranks
from arena.rating.rules import Unit
from tests.rating.paper import (
    ELO,
    MINUS,
    NAMES,
    PLUS,
    RANKS,
    VOTES,
    fitting_votes,
    pair_counts,
    simulated_votes,
)

WINNERS = {1.0: "model_a", 0.5: "tie", 0.0: "model_b"}


def test_the_printed_ranks_follow_from_the_printed_intervals() -> None:
    assert ranks(ELO - MINUS, ELO + PLUS).tolist() == RANKS.tolist()


def test_the_simulated_pairs_add_up_to_the_printed_votes() -> None:
    assert pair_counts().sum(axis=1) == pytest.approx(VOTES, abs=0.01)
    assert pair_counts().sum() == pytest.approx(2 * 5760, abs=0.1)


def test_paper_mode_on_simulated_votes_gives_half_widths_of_the_printed_size() -> None:
    """Within 2 points on average, with a tie share of about 0.6; simulated, not the paper's."""
    halves = []
    for seed in range(8):
        board = rate(simulated_votes(seed), unit=Unit.VOTE, rounds=PAPER_ROUNDS, seed=seed)
        assert board.tie_share == pytest.approx(0.6, abs=0.03)
        bounds = np.array([(line.lower, line.upper) for line in board.lines], dtype=np.float64)
        halves.append((bounds[:, 1] - bounds[:, 0]) / 2.0)
    off = np.abs(np.mean(halves, axis=0) - (MINUS + PLUS) / 2.0)
    assert off.mean() < 2.0


@pytest.mark.parametrize("seed", range(4))
def test_votes_that_fit_the_printed_ratings_have_the_printed_ranks(seed: int) -> None:
    board = rate(fitting_votes(0.65), unit=Unit.VOTE, rounds=PAPER_ROUNDS, seed=seed)
    assert [line.rating for line in board.lines] == pytest.approx(ELO.tolist(), abs=2.5)
    assert [line.rank for line in board.lines] == RANKS.tolist()


def test_the_simulation_as_latex_has_the_tables_exact_form(tmp_path: Path) -> None:
    path = tmp_path / "simulated.csv"
    votes = simulated_votes(1)
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["model_a", "model_b", "winner"])
        for first, second, score, count in zip(
            votes.first, votes.second, votes.score, votes.count, strict=True
        ):
            vote = [NAMES[first], NAMES[second], WINNERS[float(score)]]
            writer.writerows([vote] * int(count))
    said = run(file=str(path), resample="vote", rounds=PAPER_ROUNDS, format="latex")
    body = said[said.index(r"\begin{table}") :]
    line = r"    [^&]+ & \d & \d{3,4} & -\d+/\+\d+ & \d+\\\\\n"
    form = (
        r"\\begin\{table\}\n    \\centering\n"
        r"    \\begin\{tabular\}\{l>\{\\columncolor\{llm_blue!20\}\}c r r r\}\n    \\toprule\n"
        r"    \\textbf\{Model\} & \\textbf\{Rank\} & \\textbf\{Elo\}~\$\\uparrow\$ & "
        r"\\textbf\{95\\% CI\} & \\textbf\{Votes\}\\\\\n    \\midrule\n"
        + f"(?:{line}){{9}}"
        + r"    \\bottomrule\n    \\end\{tabular\}\n"
        r"    \\caption\{Elo with 95\\% confidence intervals: [^\n]*\d votes\.\}\n"
        r"    \\label\{tab:elo\}\n"
        r"\\end\{table\}\n"
    )
    assert re.fullmatch(form, body)
    printed = re.findall(r"^    ([^&\n]+) & .* & (\d+)\\\\$", body, re.M)
    assert {name: int(count) for name, count in printed} == pytest.approx(
        dict(zip(NAMES, VOTES.tolist(), strict=True)), abs=4
    )
