"""Drives of stored augmentations by planners: simulated, scored, swept."""

from augment.services.driving.driving_scores import (
    CLOSE_M,
    DrivingLine,
    DrivingScores,
    clearance_text,
    drives_of_job,
    find_shown,
    options_driven,
    scores_of_augmentations,
    scores_of_job,
)
from augment.services.driving.nuplan_results import import_results
from augment.services.driving.planner_table import (
    PlannerLine,
    PlannerTable,
    compare_job,
    ways_to_compare,
)
from augment.services.driving.simulations import NUPLAN, blind_drive, drive_file, plan_scenario
from augment.services.driving.sweeps import LARGEST_FAMILY, SweepRequest, add_family, plan_sweep
from augment.services.driving.thresholds import (
    SweepResult,
    driver_name,
    list_allowed_planners,
    sweep_result,
)
