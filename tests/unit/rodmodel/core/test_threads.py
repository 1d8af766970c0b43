"""Rows shared among threads: each is done once, and an error reaches the caller."""

import threading

import numpy as np
import pytest

from rodmodel.core import in_parts


@pytest.mark.parametrize(("count", "threads"), [(0, 1), (0, 3), (1, 2), (5, 1), (7, 3), (1000, 2), (1000, 5)])
def test_parts_cover_each_row_once(count: int, threads: int) -> None:
    done = np.zeros(count, dtype=int)

    def part(first: int, last: int) -> None:
        done[first:last] += 1

    in_parts(part, count, threads)
    np.testing.assert_array_equal(done, 1)


def test_all_threads_take_parts() -> None:
    # No part ends before two threads are at work: on one alone this would wait for ever.
    both = threading.Barrier(2, timeout=60.0)
    at_work: set[int] = set()

    def part(first: int, last: int) -> None:
        if threading.get_ident() not in at_work:
            at_work.add(threading.get_ident())
            both.wait()

    in_parts(part, 100, 2)
    assert len(at_work) == 2


@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_of_any_part_is_raised(threads: int) -> None:
    def part(first: int, last: int) -> None:
        if first <= 99 < last:
            raise RuntimeError("row 99")

    with pytest.raises(RuntimeError, match="row 99"):
        in_parts(part, 100, threads)
