"""Jobs as they run: what they may use, who works on which row, each call, and what came out."""

from augment.services.running.budget import Caps, count_unpriced
from augment.services.running.choosing import can_run, find_job, find_obstacle, resolve_contestants
from augment.services.running.entering import AcceptRequest, accept_submission
from augment.services.running.estimates import JobEstimate
from augment.services.running.follow_ups import FollowUpRequest, ask_follow_up, steps_to
from augment.services.running.intent_readings import plan_reading
from augment.services.running.jobs import JobRequest, JobScope
from augment.services.running.judge_runs import (
    JUDGEMENTS,
    Exchange,
    JudgeEstimate,
    JudgeRequest,
    ShownPair,
    cancel_judge,
    combine_answers,
    estimate_judge,
    exchange,
    plan_judge,
)
from augment.services.running.matrix import add_cells, find_cells, make_matrix
from augment.services.running.progress import (
    JobCounts,
    count_each,
    count_rows,
    list_cells,
    tool_calls,
)
from augment.services.running.transcript_records import (
    full_transcript,
    list_tries,
    make_record,
    sum_totals,
    tries_by_augmentation,
)
from augment.services.running.workers import workforce
