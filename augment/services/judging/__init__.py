"""Measures of stored augmentations: checks, displacement, drives."""

from augment.services.judging.analyses import (
    augmentation_lines,
    count_unmeasured,
    measure_job,
    read_answers,
    repeatability,
)
from augment.services.judging.displacement import (
    ALIKE,
    PLACED_EXACTLY,
    alike_pairs,
    list_objects,
    pairs_apart,
)
from augment.services.judging.findings import (
    FaultClass,
    check_augmentation,
    check_edit,
    guess_faults,
)
from augment.services.judging.measures import COMPUTED, compute_once, delete_computed, digest_code
from augment.services.judging.metric_scores import metric_scores
from augment.services.judging.realism import (
    RANDOM_DRAWS,
    RealismLine,
    RealismTable,
    realism_of_job,
)
from augment.services.judging.scenario_export import (
    Archive,
    ExportOrigin,
    Source,
    export_job,
    export_rows,
    list_warnings,
    scene_source,
)
