"""Settings of the process: compiled code runs in the thread that calls it, whole."""

import json
import os
import subprocess
import sys

SCRIPT = """
import json, os, sys, time
from fem_reference import prepare_process

if sys.argv[1] == "prepared":
    prepare_process()
import jax, jax.numpy as jnp

@jax.jit
def loop(start):
    return jax.lax.fori_loop(0, 1000, lambda _, x: jnp.sin(x), start)

start = jnp.ones(100_000)
jax.block_until_ready(loop(start))
here, everywhere = time.thread_time(), time.process_time()
jax.block_until_ready(loop(start))
here, everywhere = time.thread_time() - here, time.process_time() - everywhere
parts = loop.lower(start).compile().as_text().count("outer_dimension_partitions")
print(json.dumps({"share": here / everywhere, "parts": parts, "left": os.environ.get("NPROC")}))
"""


def test_compiled_code_runs_whole_in_the_calling_thread() -> None:
    """All of the processor's time is its own, half a second; by default the loop is cut for other threads."""
    # One's compiled code is not to serve the other.
    alone = {name: value for name, value in os.environ.items() if name != "JAX_COMPILATION_CACHE_DIR"}
    found = {}
    for name in ("prepared", "plain"):
        command = [sys.executable, "-c", SCRIPT, name]
        run = subprocess.run(command, env=alone, capture_output=True, text=True, check=True)
        found[name] = json.loads(run.stdout)
    assert found["prepared"]["share"] > 0.9
    assert found["prepared"]["parts"] == 0
    if len(os.sched_getaffinity(0)) > 1:
        assert found["plain"]["parts"] > 0
    assert found["prepared"]["left"] is None


LOST = """
import gc, signal, time
from fem_reference.runtime import keep_interrupts

def interrupted(phase, info):
    gc.callbacks.remove(interrupted)
    signal.raise_signal(signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)
for _ in range(2):
    keep_interrupts()
gc.callbacks.append(interrupted)
try:
    gc.collect()
    time.sleep(3600.0)
except KeyboardInterrupt:
    print("came again")
"""


def test_an_interrupt_that_falls_into_a_callback_of_the_collector_comes_again() -> None:
    """And wakes a thread that waits: an hour's sleep would run into the limit of the process."""
    run = subprocess.run(
        [sys.executable, "-c", LOST], capture_output=True, text=True, check=True, timeout=50.0
    )
    assert run.stdout == "came again\n"
    assert run.stderr == ""
