"""Benchmarks as rows, and the submissions that systems send to them."""

from augment.services.benchmarks.benchmarks import (
    BenchmarkRequest,
    Split,
    Stratum,
    benchmark_set,
    find_benchmark,
    list_remarks,
    make_benchmark,
    plan_benchmark,
    public_origins,
    refuse_handed_out,
    write_folder,
)
from augment.services.benchmarks.submissions import keep_submission
