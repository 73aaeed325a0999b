"""Votes as they come in files from elsewhere, and what is printed of them."""

import json
from pathlib import Path
from typing import Any

from arena.management.rate_csv import run

HEAD = "model_a,model_b,winner"
PLAIN = [
    *["a,b,model_a"] * 30,
    *["a,b,tie"] * 5,
    *["b,a,model_a"] * 20,
    *["b,c,tie (bothbad)"] * 9,
    *["c,b,model_b"] * 12,
    *["c,a,model_a"] * 14,
]
WITH_CLUSTERS = f"{HEAD},judge,item"


def write_votes(
    folder: Path, *lines: str, head: str = HEAD, start: str = "", end: str = "\n"
) -> Path:
    path = folder / "votes.csv"
    path.write_bytes((start + end.join([head, *lines]) + end).encode())
    return path


def document(file: str, **options: Any) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads(run(file=file, format="json", **options))
    return loaded


def clustered(number: int = 400) -> list[str]:
    winners = ["model_a", "tie", "model_b", "model_a", "model_b"]
    pairs = ["a,b", "b,c", "c,a", "b,a"]
    return [
        f"{pairs[n % 4]},{winners[(n * n) % 5]},j{(n * 7) % 23},i{n % 29}" for n in range(number)
    ]
