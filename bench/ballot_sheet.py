"""The first pairs of a study as one contact sheet: how large they are and how far they differ.

    python -m bench.ballot_sheet FOLDER [PAIRS]

Runs the demo in that folder unless it is there, opens a study of it, has its pairs drawn and
writes `sheet.png`: of each pair both pictures, pixels a metre in a window of 1280x720, and by how
many pixels the changes differ there, or in their inset; a pair that nobody can tell apart is shown
as one of the sample that tests the rule, and is marked. Of films it says how often somebody
changed, or the ego, is out of the frame.
"""

import io
import statistics
import sys
from pathlib import Path
from typing import Any

PAIRS = 30
STUDY = "Sheet"
_CELL_PX, _TEXT_PX = (300, 150), 16


def main(folder: Path, pairs: int) -> None:
    """Make what the sheet needs, in a process with the folder's settings, and the sheet."""
    from tests.stack import SMALL_DEMO, Home

    home = Home.at(folder)
    home.must(*SMALL_DEMO)
    made = f"from bench.ballot_sheet import write_sheet; write_sheet({str(folder)!r}, {pairs})"
    print(home.must("shell", "-c", made))


def write_sheet(folder: str, pairs: int) -> None:
    """Write the sheet and print the figures; within Django."""
    from django.core.files.storage import default_storage
    from PIL import Image, ImageDraw

    rows = [_measure(row) for row in _open_study(pairs).matchups.order_by("position")]
    width, height = _CELL_PX
    sheet = Image.new("RGB", (4 * width, -(-len(rows) // 2) * (height + _TEXT_PX)), "white")
    pen = ImageDraw.Draw(sheet)
    for number, (row, px_per_m, differs_px, _, alike) in enumerate(rows):
        left, top = number % 2 * 2 * width, number // 2 * (height + _TEXT_PX)
        for side, name in enumerate((row.left_image, row.right_image)):
            with default_storage.open(name) as file:
                picture = Image.open(io.BytesIO(file.read())).convert("RGB")
            picture.thumbnail((width - 4, height))
            sheet.paste(picture, (left + side * width, top + _TEXT_PX))
        differs = "other things" if differs_px is None else f"{differs_px:.1f} px"
        differs += ", alike" if alike else ""
        text = f"{row.position}: {px_per_m:.1f} px/m, {differs}, {row.scenario.slug}"
        pen.text((left, top), text, fill=0)
    sheet.save(Path(folder) / "sheet.png")
    stills = sorted(px_per_m for row, px_per_m, *_ in rows if "-film/" not in row.left_image)
    films = [outside for row, *_, outside, _ in rows if "-film/" in row.left_image]
    compared = [px for *_, px, _, alike in rows if px is not None and not alike]
    print(f"Stills {len(stills)}: median {statistics.median(stills):.1f} px/m,", end=" ")
    print(f"5 % below {stills[len(stills) // 20]:.1f}, least {stills[0]:.1f}.")
    print(f"Films {len(films)}: moments with somebody outside {sum(films)}.")
    print(f"Least difference of {len(compared)} comparable pairs: {min(compared):.1f} px.")
    print(f"Shown as a sample of those that look alike: {sum(alike for *_, alike in rows)}.")


# Private


def _open_study(pairs: int) -> Any:
    from django.contrib.auth.models import User

    from arena.people.services import create_person
    from arena.studies.services.opening import open_study
    from arena.studies.services.plan import StudyPlan
    from arena.voting.services.drawing import draw_pictures
    from augment.models import Augmentation

    done = Augmentation.objects.filter(state=Augmentation.State.DONE)
    username = f"sheet-{User.objects.count()}"
    create_person(username=username, password=None, role="expert")
    study = open_study(
        StudyPlan(
            name=f"{STUDY} of {username}",
            contestants=tuple(sorted(set(done.values_list("contestant__slug", flat=True)))),
            scenarios=tuple(sorted(set(done.values_list("scenario__slug", flat=True)))),
            experts=(username,),
            votes_per_expert=pairs,
            seed=5,
            repeats=0.0,
            checks=0.0,
            overlap=0.0,
            allow_simulated=True,
        )
    )
    draw_pictures(study)
    return study


def _measure(row: Any) -> tuple[Any, float, float | None, int, bool]:
    """Return a matchup, px a metre, px of difference, moments out of frame, and if it is alike."""
    from augment.geometry.frames import Pose, corners
    from augment.metrics.displacement import are_alike, find_shifts
    from augment.render.pair_window import film_states
    from augment.services.scenarios.pair_pictures import frame_pair

    loaded, sides, camera = frame_pair(row.left, row.right)
    shifts = find_shifts(*sides)
    scale = camera.inset.camera.px_per_m if camera.inset else camera.px_per_m
    differs_px = max((one.metres for one in shifts), default=0.0) * scale if shifts else None
    outside = 0
    for side in sides if camera.is_filmed else ():
        motion = loaded.ground.motion_after(side, of_all=False)
        for movement in (motion.ego, *motion.others):
            is_shown = movement is motion.ego or movement.agent in side.changed
            for x_m, y_m, heading_rad, _ in film_states(movement).tolist() if is_shown else ():
                agent, pose = movement.agent, Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
                box = camera.to_pixels(corners(pose, agent.length_m, agent.width_m))
                outside += bool(
                    (box < 0.0).any() or (box > [camera.width_px, camera.height_px]).any()
                )
    return row, camera.px_per_m, differs_px, outside, are_alike(*sides)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else PAIRS)
