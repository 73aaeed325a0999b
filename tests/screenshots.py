"""Every page, light and dark, into docs/images/pages: `python -m tests.screenshots [FOLDER]`.

Fills a new installation with the demo (authored scenes, simulated people and models), serves it,
and opens every page of the table of access with Chromium at 1280 px. What answers no page there
(a file, a question that is not asked there) is left out and said. With a
folder, the demo that is there is used again; with `--measure` each page is told by its name, its
height and its controls at 1440 x 900 instead, and no picture is taken.
"""

import io
import json
import os
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import django
from PIL import Image
from playwright.sync_api import Browser, Error, Page, TimeoutError

from tests.browser.chromium import PATIENCE_MS, chromium
from tests.formats.av2_logs import write_log
from tests.processes import ROOT
from tests.stack import SMALL_DEMO, Home

FOLDER = ROOT / "docs" / "images" / "pages"
SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
MEASURE = "--measure"
CONTROLS = """
() => [...document.querySelectorAll("a[href], button, input, select, textarea, summary")].filter(
  (one) => one.checkVisibility({ visibilityProperty: true }) && one.getClientRects().length
    && one.type !== "hidden" && !one.closest(".skip, .unseen"),
).length
"""
WIDTH, LEAST, MOST = 1280, 720, 1600
"""A page is shown from its top, so many pixels high at least and at most."""

QUALITIES = (50, 35, 20)
LIGHT = 40_000
"""Bytes: the first quality that stays below, else the last one."""
IDLE_MS = 10_000
RECORDED = "recorded-street"
TRIES = 3
VOTES_HERE = ("vote", "vote-practice", "vote-skipped")
OPEN_HERE = ("study", "enrolment", "preregistration", "invite")


@dataclass(frozen=True, slots=True, kw_only=True)
class Shot:
    """A page and who opens it, nobody where `who` is empty."""

    name: str
    who: str
    path: str


def main() -> None:
    """Fill, open, write."""
    given = [one for one in sys.argv[1:] if one != MEASURE]
    with tempfile.TemporaryDirectory(prefix="arena-shots-") as folder:
        home = Home.at(Path(next(iter(given), folder)).resolve())
        home.folder.mkdir(exist_ok=True)
        if not home.database.exists():
            home.must(*SMALL_DEMO)
            log = write_log(home.folder / "log")
            home.must("import_scene", str(log), "--slug", RECORDED)
        os.environ.update(home.environment)
        os.environ |= {
            "DJANGO_SETTINGS_MODULE": "arena.config.settings",
            "DJANGO_ALLOW_ASYNC_UNSAFE": "true",  # Playwright keeps an event loop in this thread
        }
        django.setup()
        shots, sessions = _shots(), _sessions()
        with home.serving() as url, chromium() as browser:
            pages = {who: _page(browser, url, sessions.get(who)) for who in ("", *sessions)}
            if MEASURE in sys.argv:
                measured = {one.name: _measure(pages, url, one) for one in shots}
                print(json.dumps({name: size for name, size in measured.items() if size}))
                return
            taken = [one for one in shots if _take(pages[one.who], url, one)]
    size = sum(path.stat().st_size for path in FOLDER.glob("*.webp"))
    print(f"{len(taken)} pages, {size / 1e6:.1f} MB")


# --- Private -----------------------------------------------------------------------------------


def _shots() -> list[Shot]:
    """Every page that somebody may open, with the address of something that there is."""
    from django.contrib.auth.models import User

    from arena.jobs.pages.jobs import TABS as PARTS
    from arena.management.commands.demo import OPEN_STUDY
    from arena.models import Study
    from arena.results.pages.tabs import TABS
    from arena.site.demo import JOB, SIMULATED_STUDY
    from augment.models import Augmentation, BaseScene, GenerationJob, Simulation
    from augment.services.scenarios.pictures import draw_scene
    from tests.web.addresses import address
    from tests.web.cast import World
    from tests.web.test_access import ACTIONS, PAGES

    job = GenerationJob.objects.get(name=JOB)
    made = job.augmentations.filter(state=Augmentation.State.DONE, attempts__calls__isnull=False)
    row = made.select_related("scenario__base_scene", "contestant").first()
    assert row is not None
    closed, is_open = (Study.objects.get(name=name) for name in (SIMULATED_STUDY, OPEN_STUDY))
    judge = closed.matchups.first()
    assert judge is not None
    voter = User.objects.get(username="expert")
    rated = World(study=closed, job=job, augmentation=row, expert=judge.expert)
    voted = World(study=is_open, job=job, augmentation=row, expert=voter)
    drive = Simulation.objects.filter(state=Simulation.State.DONE).first()
    shots = [
        Shot(name="login", who="", path="/login/"),
        Shot(name="home-of-an-expert", who="expert", path="/"),
        Shot(name="home-of-a-researcher", who="researcher", path="/"),
        Shot(name="home-of-an-admin", who="admin", path="/"),
    ]
    for name in sorted(PAGES.keys() - ACTIONS.keys() - {"home", "drive", "job-tab"}):
        who = "expert" if name in VOTES_HERE else "admin"
        here = voted if name in (*VOTES_HERE, *OPEN_HERE) else rated
        shots.append(Shot(name=name, who=who, path=address(name, here)))
    results = address("results", rated)
    shots += [Shot(name=f"results-{tab}", who="admin", path=f"{results}{tab}/") for tab in TABS]
    shots += [
        Shot(name=f"job-{tab}", who="admin", path=f"/jobs/{job.code}/{tab}/") for tab in PARTS
    ]
    shots += [Shot(name="job-again", who="admin", path=f"/jobs/new/?like={job.code}")]
    if recorded := BaseScene.objects.filter(slug=RECORDED).first():
        draw_scene(recorded.pk)
        path = f"/scenes/{recorded.code}/"
        shots.append(Shot(name="scene-of-a-recording", who="admin", path=path))
    if drive is not None:
        shots.append(Shot(name="drive", who="admin", path=f"/drives/{drive.code}/"))
    return shots


def _sessions() -> dict[str, str]:
    """A signed-in session of each account of the demo."""
    from django.conf import settings
    from django.contrib.auth.models import User
    from django.test import Client

    found = {}
    for username in ("admin", "researcher", "expert"):
        client = Client()
        client.force_login(User.objects.get(username=username))
        found[username] = client.cookies[settings.SESSION_COOKIE_NAME].value
    return found


def _measure(pages: dict[str, Page], url: str, shot: Shot) -> list[int]:
    """Height and visible controls of a page on a desk; empty where it answers none."""
    page = pages[shot.who]
    page.set_viewport_size({"width": 1440, "height": 900})
    for attempt in range(1, TRIES + 1):
        if not _open(page, url, shot):
            return []
        try:
            page.wait_for_load_state("networkidle", timeout=IDLE_MS)
        except TimeoutError:  # a page that asks again and again; it is measured as it stands
            print(f"{shot.name}: still asking after {IDLE_MS / 1e3:g} s", file=sys.stderr)
        try:
            return [
                page.evaluate("document.documentElement.scrollHeight"),
                page.evaluate(CONTROLS),
            ]
        except Error as error:  # it showed itself anew meanwhile
            print(f"{shot.name}, try {attempt}: {error.message}", file=sys.stderr)
    raise RuntimeError(f"{shot.name} could not be measured in {TRIES} tries")


def _open(page: Page, url: str, shot: Shot) -> bool:
    """Whether it answers a page, which is open then."""
    try:
        answer = page.goto(url + shot.path, wait_until="load")
    except Error as error:  # a file is downloaded, which ends the visit
        print(f"{shot.name}: {error.message.splitlines()[0]}", file=sys.stderr)
        return False
    assert answer is not None
    if not answer.ok or "text/html" not in answer.headers.get("content-type", ""):
        print(f"{shot.name}: {answer.status}", file=sys.stderr)
        return False
    return True


def _take(page: Page, url: str, shot: Shot) -> bool:
    """Both pictures of a page; False where it answers none."""
    if not _open(page, url, shot):
        return False
    page.set_viewport_size({"width": WIDTH, "height": LEAST})
    high = page.evaluate("document.documentElement.scrollHeight")
    page.set_viewport_size({"width": WIDTH, "height": min(max(high, LEAST), MOST)})
    page.wait_for_load_state("networkidle")
    for taken_over in page.get_by_role("button", name="Use this one").all():
        if taken_over.is_visible():  # the voting page knows that it was open a moment ago
            taken_over.click()
            page.wait_for_load_state("networkidle")
    for scheme in SCHEMES:
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        _keep(page.screenshot(), FOLDER / f"{shot.name}-{scheme}.webp")
    return True


def _page(browser: Browser, url: str, session: str | None) -> Page:
    context = browser.new_context(viewport={"width": WIDTH, "height": LEAST}, locale="en-GB")
    context.set_default_timeout(PATIENCE_MS)
    if session is not None:
        context.add_cookies([{"name": "sessionid", "value": session, "url": url}])
    return context.new_page()


def _keep(png: bytes, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    for quality in QUALITIES:
        picture.save(path, "WEBP", quality=quality, method=6)
        if path.stat().st_size < LIGHT:
            return


if __name__ == "__main__":
    main()
