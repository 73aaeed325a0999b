"""What is to be driven: a scene, what was changed in it, and what was recorded after t0."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from augment.scene.entities import Modification, Scene, apply
from augment.scene.recording import Recording


@dataclass(frozen=True, kw_only=True, eq=False)
class DriveSetting:
    """A scene with its change.

    Attributes:
        scene: Before the change.
        modification: What changes; nothing by default.
        recording: Tracks and ego motion after t0, None where nothing was recorded. It also says
            which way the ego takes and how far an expert came.
        replay: Whether the recorded others are part of the drive; interPlan clears them.
        reactive: Whether recorded vehicles that move follow their lanes and answer to the ego,
            instead of doing what they did. Who was never recorded answers in any case.
    """

    scene: Scene
    modification: Modification = field(default_factory=Modification)
    recording: Recording | None = None
    replay: bool = True
    reactive: bool = False

    @cached_property
    def after(self) -> Scene:
        """The scene after the change.

        Raises:
            InvalidModification: The change does not fit the scene.
        """
        return apply(self.scene, self.modification)

    @property
    def replaced(self) -> frozenset[str]:
        """Ids whose recorded tracks no longer count."""
        return frozenset(
            [agent.id for agent in self.modification.moved] + list(self.modification.removed)
        )
