"""Rows shared among threads: the core releases Python's global lock."""

from collections.abc import Callable
from threading import Thread

# Parts of the rows for each thread. One that the machine slows down leaves its later parts to the others.
_PARTS = 4


def in_parts(part: Callable[[int, int], None], count: int, threads: int) -> None:
    """Call a function of a first and a last row on parts that cover all rows, on this thread and others.

    Raises
    ------
    ValueError
        For less than one thread.
    Exception
        The first that the function raised on any thread, after all have ended.
    """
    if threads < 1:
        raise ValueError(f"threads: got {threads}, expected 1 or more")
    if threads == 1 or count < 2 * threads:
        part(0, count)
        return
    parts = min(count, _PARTS * threads)
    rows = iter([(count * k // parts, count * (k + 1) // parts) for k in range(parts)])
    errors: list[BaseException] = []

    def work() -> None:
        try:
            # A list's iterator gives each part to one thread alone.
            for first, last in rows:
                part(first, last)
        except BaseException as error:
            errors.append(error)

    others = [Thread(target=work) for _ in range(threads - 1)]
    for other in others:
        other.start()
    work()
    for other in others:
        other.join()
    if errors:
        raise errors[0]
