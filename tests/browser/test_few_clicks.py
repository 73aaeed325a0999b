"""From an empty installation to a table in LaTeX: in how many clicks, by all that a job does."""

import csv
import json
import subprocess
import sys
import threading
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from augment.fake_llm.server import FakeServer, running
from augment.llm.questions import Ability
from augment.scene.entities import Scene
from augment.scene.intent import Intent
from tests.browser.chromium import chromium
from tests.browser.hand import Hand
from tests.browser.job_round import SCENARIOS, run_round
from tests.formats.av2_logs import write_log
from tests.parked import TYPE, asked, known, reference, wish, write_street
from tests.processes import ROOT
from tests.stack import Home

pytestmark = [pytest.mark.browser, pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]


OVER_MS = 300_000


@pytest.fixture
def home(tmp_path: Path) -> Home:
    made = Home.at(tmp_path / "h")
    made.folder.mkdir()
    return made


def _as_ada(home: Home, work: Callable[[Hand, Browser], str]) -> Hand:
    """The admin after all of the work, which ends at a table."""

    def all_of_it(address: str) -> tuple[Hand, str]:
        with chromium() as browser:
            ada = Hand.at(browser, address)
            ada.become_admin(home)
            return ada, work(ada, browser)

    with home.serving() as address, ThreadPoolExecutor(1) as pool:
        # Playwright wants a thread without an event loop.
        ada, table = pool.submit(all_of_it, address).result()
    assert r"\toprule" in table
    assert "Reference" in table
    return ada


def test_two_contestants_on_the_catalogue(home: Home) -> None:
    def work(ada: Hand, browser: Browser) -> str:
        ada.press("Scenarios")
        ada.press("Load the paper set")
        ada.sees("50 added")
        _run_job(ada)
        return _study(ada, browser, votes=5)

    ada = _as_ada(home, work)
    assert ada.clicks <= 25
    assert ada.fields <= 12


@contextmanager
def stand_in_process(home: Home) -> Iterator[str]:
    """The address of a stand-in server that knows the scenarios of a home."""
    command = [sys.executable, "manage.py", "fake_llm", "--port", "0"]
    with subprocess.Popen(
        command, cwd=ROOT, env=home.environment, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().split()[-1]
        finally:
            process.terminate()


def test_a_model_in_four_variants_on_a_recording(home: Home, tmp_path: Path) -> None:
    packed, folder = tmp_path / "log.zip", write_log(tmp_path / "log")
    with zipfile.ZipFile(packed, "w") as made:
        for file in sorted(folder.rglob("*")):
            made.write(file, file.relative_to(tmp_path))

    def work(ada: Hand, browser: Browser) -> str:
        ada.press("Use mine")
        ada.fill("base_url", address)
        ada.press("Add the endpoint")
        expect(ada.page.locator("#listed-models option[value=fake-good]")).to_be_attached()
        ada.fill("model", "fake-good")
        ada.press("Add and probe it")
        ada.sees("It sees pictures", within_ms=OVER_MS)
        _draw_on_a_recording(ada, packed)
        ada.press("next: choose contestants")
        ada.press("Add them")
        ada.press("next: launch a job")
        ada.fill("name", "Round 1")
        ada.click("[data-launch]")
        ada.sees("Finished", within_ms=OVER_MS)
        return _study(ada, browser, votes=1)

    with stand_in_process(home) as address:
        ada = _as_ada(home, work)
    assert ada.clicks <= 24
    assert ada.fields <= 8


def _draw_on_a_recording(ada: Hand, packed: Path) -> None:
    """A car, placed 15 m ahead of the ego by a click."""
    ada.press("next: make scenarios")
    ada.send(packed)
    ada.press("Use this moment")
    expect(ada.page.get_by_role("heading", name="log")).to_be_visible()
    ada.page.wait_for_load_state("networkidle")
    ada.press("Place by a click")
    ada.click_scene(15, 0.5)
    ada.press("Save the scenario")
    expect(ada.page.locator("img[src*='/pictures/reference/']")).to_be_visible()


def _run_job(ada: Hand) -> None:
    ada.press("Jobs")
    ada.press("New job")
    ada.fill("name", "Round 1")
    ada.tick_only("contestants", "reference", "quantised-5m")
    ada.click("[data-launch]")
    ada.sees("Finished", within_ms=OVER_MS)


def _study(ada: Hand, browser: Browser, *, votes: int) -> str:
    link = ada.add_expert("grace")
    ada.press("Studies")
    ada.press("New study")
    ada.fill("name", "First study")
    ada.fill("votes_per_expert", str(votes))
    ada.sees(f"{votes} from each of 1 expert")
    ada.press("Open the study")
    expect(ada.page.get_by_role("heading", name="First study")).to_be_visible()
    grace = Hand.at(browser, ada.page.url)
    grace.page.goto(link)
    grace.press("Accept and start")
    grace.vote(votes)
    ada.page.reload()
    return ada.close_and_export()


VOTES_EACH = 6


@dataclass(frozen=True)
class StandIn:
    """The server of the models, which can be kept from answering."""

    gate: threading.Event = field(default_factory=threading.Event)

    def known(self, instruction: str) -> list[tuple[Scene, Intent]]:
        self.gate.wait(timeout=120)
        return known(instruction)


@pytest.fixture
def stand_in() -> StandIn:
    made = StandIn()
    made.gate.set()
    return made


@pytest.fixture
def model(stand_in: StandIn) -> Iterator[FakeServer]:
    with running(known=stand_in.known) as serving:
        yield serving
        stand_in.gate.set()


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A scene; a list of all scenarios but the first, with their documents."""
    folder = tmp_path / "files"
    folder.mkdir()
    write_street(folder)
    with (folder / "many.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["scene", "type", "instruction", "slug", "reference", "intent"])
        for number in range(1, SCENARIOS):
            ahead_m = 15 + 5 * number
            documents = [json.dumps(one) for one in (reference(ahead_m), asked(ahead_m))]
            said = ["street", TYPE, wish(ahead_m), f"parked-{ahead_m}"]
            table.writerow([*said, *documents])
    return folder


def test_an_empty_house_ends_at_a_table(
    model: FakeServer, stand_in: StandIn, files: Path, tmp_path: Path
) -> None:
    home = Home.at(tmp_path / "h")
    home.folder.mkdir()
    with home.serving() as address, ThreadPoolExecutor(1) as pool:
        # Playwright wants a thread without an event loop.
        work = pool.submit(_from_nothing, home, address, model.url, stand_in.gate, files)
        table = work.result()
    assert r"\toprule" in table
    for name in ("Reference", "Rule placer", "fake-careless"):
        assert name in table


def _from_nothing(home: Home, address: str, model: str, gate: threading.Event, files: Path) -> str:
    with chromium() as browser:
        ada = Hand.at(browser, address)
        ada.become_admin(home)
        admin = ada.page
        _send_scene(admin, files)
        _write_scenarios(admin, files)
        _enter_models(admin, model)
        _enter_contestant(admin)
        run_round(admin, gate)
        link = ada.add_expert("grace")
        _open_simulated(ada)
        grace = Hand.at(browser, address)
        grace.page.goto(link)
        grace.press("Accept and start")
        grace.vote(VOTES_EACH)
        admin.reload()
        return ada.close_and_export()


def _send_scene(page: Page, files: Path) -> None:
    page.goto("/scenes/")
    page.set_input_files("[name=file]", files / "street.json")
    page.get_by_role("button", name="Use this moment").click()
    expect(page.get_by_role("heading", name="street")).to_be_visible()


def _write_scenarios(page: Page, files: Path) -> None:
    """One drawn on its scene, as JSON; the others by a list."""
    page.fill("[name=instruction]", wish(15))
    page.select_option("[name=type]", TYPE)
    page.get_by_text("Advanced", exact=True).click()
    page.fill("[name=slug]", "parked-15")
    page.locator("summary", has_text="The drawing as JSON").click()
    page.fill("[name=modification]", json.dumps(reference(15)))
    page.get_by_role("button", name="Save the scenario").click()
    expect(page.get_by_text("“parked-15” is added")).to_be_visible()
    page.goto("/scenarios/bulk/")
    page.set_input_files("[name=file]", files / "many.csv")
    page.get_by_role("button", name="Add them").click()
    expect(page.get_by_text(f"{SCENARIOS - 1} scenarios are added")).to_be_visible()


def _enter_models(page: Page, model: str) -> None:
    """An endpoint with a model that fails and one that works, priced and probed."""
    page.goto("/endpoints/new/")
    page.fill("[name=label]", "stand-in")
    page.fill("[name=base_url]", model)
    page.get_by_text("Advanced").click()
    page.fill("[name=max_concurrency]", "2")
    page.check("[name=is_simulated]")
    page.click("button.main.big")
    page.fill("#new-model", "fake-quota")
    page.click("form.add-model button")
    page.click("ol.crumbs a:has-text('stand-in')")
    page.fill("#new-model", "fake-careless")
    page.click("form.add-model button")
    expect(page.locator("tr[data-ability] .badge.is-good")).to_have_count(len(Ability))
    page.get_by_text("by hand").click()
    price = {"price_in_usd": "1", "price_out_usd": "4", "price_as_of": "2026-01-31"}
    for name, value in (price | {"price_source": "made up"}).items():
        page.fill(f"[name={name}]", value)
    page.get_by_role("button", name="Keep").click()


def _enter_contestant(page: Page) -> None:
    page.click("a:has-text('New contestant')")
    expect(page.locator("[name=model]")).to_have_value("stand-in|fake-careless")
    for variant in ("fc", "tqa", "vqa"):
        page.uncheck(f"[name=variant][value={variant}]")
    page.get_by_text("Advanced").click()
    page.fill("[name=temperature]", "0.7")
    page.click("button.main.big")
    expect(page.get_by_text("OTM with fake-careless")).to_be_visible()


def _open_simulated(ada: Hand) -> None:
    ada.page.goto("/studies/new/")
    ada.fill("name", "First study")
    ada.fill("votes_per_expert", str(VOTES_EACH))
    ada.press("Advanced")
    for name in ("repeats", "checks"):
        ada.fill(name, "0")
    ada.page.check("[name=allow_simulated]")
    ada.press("Open the study")
    expect(ada.page.get_by_role("heading", name="First study")).to_be_visible()
