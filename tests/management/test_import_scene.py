import json
from io import StringIO
from pathlib import Path

import pytest
from django.core.management import call_command
from django.core.management.base import CommandError

from augment.models import BaseScene, Event
from augment.scene.codec import scene_to_document
from tests.formats import openscenario_files
from tests.formats.av2_logs import write_log
from tests.formats.test_commonroad import newer
from tests.scenes import junction

pytestmark = pytest.mark.django_db


def run(*arguments: object) -> str:
    out = StringIO()
    call_command("import_scene", *(str(one) for one in arguments), stdout=out)
    return out.getvalue()


def refused(*arguments: object) -> str:
    before = BaseScene.objects.count(), Event.objects.count()
    with pytest.raises(CommandError) as caught:
        run(*arguments)
    assert caught.value.returncode == 1
    assert (BaseScene.objects.count(), Event.objects.count()) == before
    return str(caught.value)


def test_a_recorded_scene_is_imported_and_counted(tmp_path: Path) -> None:
    out = run("av2", write_log(tmp_path / "log"), "--frame", 2, "--slug", "made")
    first, *notes = out.splitlines()
    assert (
        first == "Imported scene made: 3 agents, 5 lanes, 2 connectors, 2 areas besides the ego."
    )
    assert "  9 of 9 lanes have no speed limit: drives assume a usual one." in notes
    assert Event.objects.filter(verb="import", after__frame=2).exists()


def test_a_scene_of_the_own_format_is_imported(tmp_path: Path) -> None:
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(scene_to_document(junction())))
    run("json", file, "--slug", "crossing")
    assert BaseScene.objects.get(slug="crossing").source == "json"
    assert "The same scene is stored already, as 'crossing'" in refused(
        "json", file, "--slug", "crossing"
    )
    said = refused("json", file, "--slug", "x", "--frame", 3)
    assert "a JSON scene has no parts and frame 0 alone" in said


def test_an_ego_is_put_on_a_lane_of_a_map_without_one(tmp_path: Path) -> None:
    file = tmp_path / "made.xml"
    file.write_text(newer(more="").replace("<type>car<", "<type>bus<"))
    assert "Or put an ego on a lane: --ego-at LANE,S" in refused("commonroad", file, "--slug", "x")
    out = run("commonroad", file, "--slug", "put", "--ego-at", "1,12.5")
    assert "The ego was put on lane 1, 12.5 m along it; nobody recorded it." in out
    assert BaseScene.objects.get(slug="put").document["ego"]["speed_mps"] == 0.0


def test_an_ego_is_named_or_put_on_a_road_of_a_map(tmp_path: Path) -> None:
    file = openscenario_files.write(tmp_path, openscenario_files.scenario())
    assert "1 agents, 3 lanes" in run(file, "--slug", "other", "--ego", "Other")
    out = run(tmp_path / "roads.xodr", "--slug", "alone", "--ego-at", "1,-2,120")
    assert "The ego was put on lane -2 of road 1, at s = 120 m." in out


def test_a_broken_scene_is_refused_with_the_place(tmp_path: Path) -> None:
    document = scene_to_document(junction())
    document["lanes"][1]["centerline_m"][0][1] = "zero"
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(document))
    assert "lanes[1].centerline_m[0][1]" in refused("json", file, "--slug", "crossing")
    file.write_text(json.dumps(document)[:-20])
    assert "scene.json: is not JSON" in refused("json", file, "--slug", "crossing")
    assert "is not there" in refused("json", tmp_path / "gone.json", "--slug", "crossing")
