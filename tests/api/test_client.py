"""From an empty database to a rated table in LaTeX by the client: the example of the docs."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from augment.fake_llm.server import FakeServer, running
from augment.scene.codec import scene_to_document
from augment.scene.entities import Scene
from augment.scene.intent import Body, Intent
from client.arena_client import ApiError, Arena
from tests.intents import parked
from tests.processes import wait_until
from tests.scenes import scene
from tests.stack import Home

pytestmark = [pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]

DOCS = Path(__file__).parents[2] / "docs" / "api.md"
WISH = re.compile(r"A parked car stands (\d+) m ahead of the ego\.")


def known(instruction: str) -> list[tuple[Scene, Intent]]:
    """Return what the stand-in's models know of an instruction of the example."""
    found = WISH.search(instruction)
    return [(scene(), parked(float(found[1]), body=Body.VEHICLE))] if found else []


@pytest.fixture
def model() -> Iterator[FakeServer]:
    with running(known=known) as serving:
        yield serving


def example() -> str:
    (found,) = re.findall(r"```python\n(.*?)```", DOCS.read_text(), flags=re.DOTALL)
    return str(found)


def test_the_example_of_the_docs_goes_from_nothing_to_a_table(
    model: FakeServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = Home.at(tmp_path / "h")
    home.folder.mkdir()
    with home.serving() as address:
        monkeypatch.setenv("ARENA_URL", address)
        monkeypatch.setenv("FIRST_LINK", first_link(home))
        monkeypatch.setenv("MODEL_URL", model.url)
        street = tmp_path / "street.json"
        street.write_text(json.dumps(scene_to_document(scene())))
        monkeypatch.setenv("SCENE_FILE", str(street))
        left: dict[str, Any] = {}
        exec(compile(example(), str(DOCS), "exec"), left)
        assert left["job"]["state"] == "finished"
        assert left["estimate"]["rows"] == 3 * len(left["scenarios"])
        assert {line["progress"] for line in left["probe"]["lines"]} == {"asked"}
        assert r"\toprule" in left["table"]
        for name in ("Reference", "Rule placer", "fake-careless"):
            assert name in left["table"]
        rows = left["snapshot"]["table"]["rows"]
        assert sum(line["votes"] for line in rows) == 2 * 6, "each vote is of two"
        expert = left["expert"]
        with pytest.raises(ApiError) as over:
            list(expert.pairs(left["study"]["code"]))
        assert (over.value.status, over.value.code) == (410, "study_not_open")
        with pytest.raises(ApiError) as refused:
            expert.get("contestants")
        assert (refused.value.status, refused.value.code) == (403, "forbidden")
        with pytest.raises(ApiError, match="opens nothing"):
            Arena(address, "arena_nobodys").get("studies")


def first_link(home: Home) -> str:
    def printed() -> list[str]:
        return re.findall(r"http\S+/first/\S+", (home.folder / "serve.log").read_text())

    wait_until(lambda: bool(printed()), what="the link of the first admin is printed")
    return printed()[0]
