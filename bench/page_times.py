"""What each GET of an admin takes, as a ratio to the login page: `python -m bench.page_times`.

Run it after `make demo SERVE=0`, on its data. Follows every link, picture and download from the
first page, two of each kind, and prints whose first visit takes more than `--above` times the
login page's processor time, with the median of five further visits.
"""

import argparse
import html
import os
import re
import statistics
import time
from collections import Counter, deque

from bench.report import load, table

AGAIN, OF_A_KIND = 5, 2
_CODES = re.compile(r"(?<==)[^&]+|[0-9a-f]{8}-[0-9a-f-]{27}|[0-9a-f]{16,}|\d+")
_ADDRESSES = re.compile(r'(?:href|src|data-[a-z-]+)="(/[^"#]*)')
_LEFT_OUT = ("/static/", "/logout")


def main() -> None:
    """Walk, measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--above", type=float, default=5.0, help="ratios that are shown")
    above = parser.parse_args().above
    os.environ.setdefault("DJANGO_SETTINGS_MODULE", "arena.config.settings")
    import django

    django.setup()
    from django.conf import settings
    from django.contrib.auth.models import User
    from django.test import Client

    settings.ALLOWED_HOSTS = ["testserver"]
    client = Client()

    def visit(path: str) -> tuple[float, str]:
        """Return the processor time of a page in seconds, and its text if it is HTML."""
        begin = time.process_time()
        answer = client.get(path)
        content = answer.getvalue()
        took_s = time.process_time() - begin
        is_html = "html" in answer.headers.get("Content-Type", "")
        return took_s, content.decode() if is_html else ""

    def repeat(path: str) -> float:
        return statistics.median(visit(path)[0] for _ in range(AGAIN))

    visit("/login/")
    login_s = repeat("/login/")
    client.force_login(User.objects.get(username="admin"))
    visit("/")
    known, waiting, kinds, rows = {"/"}, deque(["/"]), Counter[str](), []
    while waiting:
        path = waiting.popleft()
        kind = _CODES.sub("*", path)
        kinds[kind] += 1
        if kinds[kind] > OF_A_KIND:
            continue
        first_s, text = visit(path)
        if first_s > above * login_s:
            rows.append((repeat(path) / login_s, first_s / login_s, path))
        addresses = map(html.unescape, _ADDRESSES.findall(text))
        new = dict.fromkeys(one for one in addresses if not one.startswith(_LEFT_OUT))
        waiting.extend(one for one in new if one not in known)
        known |= new.keys()
    rows.sort(reverse=True)
    lines = [[f"{again:.1f}", f"{first:.1f}", f"`{path}`"] for again, first, path in rows]
    visited = sum(min(number, OF_A_KIND) for number in kinds.values())
    print(f"{visited} GETs; login {1000 * login_s:.1f} ms; {load()}\n")
    print(table(["times login", "first visit", "GET"], lines))


if __name__ == "__main__":
    main()
