"""Every picture that is drawn of a scene, by the hash of its pixels."""

import hashlib

from augment.render.bev import draw, draw_for_review
from augment.render.camera import camera_for
from augment.scene.entities import Modification, Scene
from tests.golden.conftest import Check
from tests.render.pictures import opened
from tests.scenes import cone, curve, junction, pedestrian, scene, vehicle

BUSY = scene(agents=(vehicle("Agent2", 18.0, 3.5, 3.1416), pedestrian("Agent3", 9.0, -3.0)))
CHANGES: dict[str, tuple[Scene, Modification]] = {
    "street-unchanged": (scene(), Modification()),
    "street-parked-car-and-walk": (
        BUSY,
        Modification(
            added=(vehicle("Agent4", 14.0, -0.7), pedestrian("Agent5", 24.0, -3.0, (24.0, 6.0)))
        ),
    ),
    "street-moved-and-removed": (
        BUSY,
        Modification(moved=(vehicle("Agent2", 25.0, 3.2, 3.0),), removed=("Agent3",)),
    ),
    "curve-cones": (
        curve(),
        Modification(added=tuple(cone(f"A{n}", 8.0 * n, 0.4) for n in (2, 3))),
    ),
    "junction-far-car": (junction(), Modification(added=(vehicle("Agent2", 50.0, 0.5),))),
}


def digest(png: bytes) -> str:
    picture = opened(png)
    size = f"{picture.width}x{picture.height}"
    return f"{size} {hashlib.sha256(picture.tobytes()).hexdigest()}"


def test_pictures_have_the_pixels_that_they_had(check: Check) -> None:
    drawn: dict[str, str] = {}
    for name, (base, change) in CHANGES.items():
        camera = camera_for(base, change)
        drawn[name] = digest(draw(base, change, camera))
        for number, png in enumerate(draw_for_review(base, change, camera), start=1):
            drawn[f"{name}, for a reviewer, {number}"] = digest(png)
    check("pictures.json", drawn)
