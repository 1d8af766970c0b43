"""Faults of a disk and of a process that tests inject: a disk that is full, a kill between any two writes."""

import contextlib
import itertools
import os
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest


@contextlib.contextmanager
def full_disk(room: int) -> Iterator[None]:
    """No file of this process grows beyond so many bytes, whoever writes it: C libraries too."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


class Killed(BaseException):
    """What stands for SIGKILL: nothing tidies up after it, as the disk is out of reach from then on."""


def killed_at_every_write(
    monkeypatch: pytest.MonkeyPatch, work: Callable[[int], Any], after: Callable[[int], Any]
) -> int:
    """Do work that is killed before its first touch of the disk, and anew before its second, and so on.

    Parameters
    ----------
    monkeypatch : pytest's.
    work : called with the number of the attempt, each of which has a place of its own on the disk.
    after : called with it when the attempt has been killed, or has ended.

    Returns
    -------
    how many attempts were killed; the one after them was not.
    """
    for attempt in itertools.count():
        with monkeypatch.context() as patch:
            _kill_before(patch, attempt)
            killed = False
            try:
                work(attempt)
            except Killed:
                killed = True
        after(attempt)
        if not killed:
            return attempt
    raise AssertionError


def _kill_before(patch: pytest.MonkeyPatch, touches: int) -> None:
    left = iter(range(touches))

    def counted(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            if next(left, None) is None:
                raise Killed
            return function(*arguments, **options)

        return call

    opened = Path.open
    writing = counted(opened)

    def open_(self: Path, mode: str = "r", *arguments: Any, **options: Any) -> Any:
        return (writing if set(mode) & set("wxa+") else opened)(self, mode, *arguments, **options)

    patch.setattr(Path, "open", open_)
    for name in ("touch", "replace", "unlink", "mkdir"):
        patch.setattr(Path, name, counted(getattr(Path, name)))
    patch.setattr(os, "fsync", counted(os.fsync))
